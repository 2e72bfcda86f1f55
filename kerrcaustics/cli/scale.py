"""The command `scale`: the size of one M for a hole of known mass and distance."""

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.options import COMMON, CommonOptions
from kerrcaustics.cli.terminal import plain_errors, say


@app.command(**with_examples("scale --mass 4.3e6 --distance 8180"))
def scale(*, mass: float, distance: float | None = None, common: CommonOptions = COMMON) -> None:
    """Print one M in seconds, metres, astronomical units and, if a distance is given, microarcseconds.

    Parameters
    ----------
    mass
        Mass of the hole, in solar masses.
    distance
        Distance from the observer, in parsecs.
    """
    common.check()
    with plain_errors():
        from kerrcaustics.interop.physical_scale import PhysicalScale

        scale = PhysicalScale(mass, distance)
    names = ("seconds", "metres", "astronomical_units", *(() if distance is None else ("microarcseconds",)))
    values = {name: getattr(scale, name) for name in names}
    common.write({"schema": "kerrcaustics/scale/1", "mass": mass, "distance": distance, **values})
    say(common.console(), "One M is " + ", ".join(f"{v:.6g} {name.replace('_', ' ')}" for name, v in values.items()))
