"""The command `rings`: photon rings, their areas, exponents and visibilities."""

import math
import time
from typing import TYPE_CHECKING

from rich.console import Console

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.options import (
    COMMON,
    UNITS_OF_MASS,
    Angle,
    CameraOptions,
    CommonOptions,
    FileName,
    Flag,
    RingOrder,
    ScaleOptions,
)
from kerrcaustics.cli.outputs import check_ending, check_table, write_figure, write_table
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import place_of, plain_errors, progress, say, say_all, verdict

if TYPE_CHECKING:
    from kerrcaustics.interop.physical_scale import PhysicalScale
    from kerrcaustics.rings.results import PhotonRings
    from kerrcaustics.rings.visibility import Visibilities

# Number of baselines of a range by default, and the largest one.
_COUNT, _MOST_COUNT = 1000, 100_000


@app.command(
    **with_examples(
        "rings --spin 0.94 --radius inf --inclination 17 --figure rings.png",
        "rings --spin 0.9 --radius 6 --inclination 60 --inner isco --outer 20",
        "rings --spin 0.94 --radius inf --inclination 17 --outer 20 --baselines 0:5 --table rings.csv",
    )
)
def rings(
    *,
    camera: CameraOptions,
    max_order: RingOrder = 3,
    inner: str | None = None,
    outer: float = math.inf,
    baselines: str | None = None,
    angle: Angle | None = None,
    position_angle: Angle | None = None,
    figure: FileName | None = None,
    table: FileName | None = None,
    save: FileName | None = None,
    scaling: ScaleOptions = UNITS_OF_MASS,
    common: CommonOptions = COMMON,
    points: Flag = False,
) -> None:
    """Compute photon rings: the bands in which matter in the equatorial plane is seen, order by order.

    Parameters
    ----------
    max_order
        Highest order n, 0 to 9; order 0 is the direct image of the matter.
    inner
        Radius of the inner edge of the matter, in units of the mass, or isco; by default the horizon.
    outer
        Radius of the outer edge of the matter, in units of the mass; by default infinite.
    baselines
        Compute visibilities of uniformly bright bands on baselines of these lengths: a number, LOW:HIGH or
        LOW:HIGH:COUNT, per M, or with --mass and --distance in giga-wavelengths. Needs an observer.
    angle
        Position angle of the baselines, east of north, degrees; 0 by default.
    position_angle
        Position angle of the projected spin axis, east of north, degrees; 0 by default.
    figure
        Save a plot of the bands, and of visibilities, to this file: .png, .pdf or .svg.
    table
        Write the visibilities to this file: .csv, or .fits (needs astropy).
    save
        Save the bands to this file, which kerrcaustics.load reads.
    points
        Include the points of the edges and the visibilities in the JSON.
    """
    common.check({"--figure": figure, "--table": table, "--save": save})
    check_ending(figure)
    check_table(table)
    common.check_points(points)
    units = scaling.scale(camera)
    if baselines is None:
        _refuse_unused({"--angle": angle, "--position-angle": position_angle, "--table": table, "--mass": units})
    else:
        _check_baselines(camera, units, math.isfinite(outer) or max_order > 0)
    turn, spin_axis = (_turn(name, value) for name, value in (("--angle", angle), ("--position-angle", position_angle)))
    lengths = [] if baselines is None else _lengths(baselines)
    viewer = camera.off_equator().viewer()
    began = time.perf_counter()
    with plain_errors({"camera": "radius", "u": "baselines"}), progress() as report:
        from kerrcaustics.results import storage
        from kerrcaustics.results.records import record
        from kerrcaustics.rings.bands import photon_rings
        from kerrcaustics.rings.visibility import ring_visibility

        result = photon_rings(viewer, max_order=max_order, inner=_inner(inner), outer=outer)
        seen = None
        if lengths:
            u, v = ([size * part for size in lengths] for part in (math.sin(turn), math.cos(turn)))
            seen = ring_visibility(result, u, v, scale=units, position_angle=spin_axis)
        seconds = time.perf_counter() - began
        if save is not None:
            storage.save(save, result)
        if table is not None and seen is not None:
            write_table(seen, table)
        if figure is not None:
            report("drawing", 1.0)
            from kerrcaustics.draw.ring_ladder import rings_figure

            write_figure(rings_figure(result, seen, units), figure)
    entry = record(result, camera=viewer, points=points)
    if seen is not None:
        entry["visibilities"] = record(seen, points=points)
    common.write_result(entry, seconds)
    _print(result, seen, common.console(), units)
    common.say_files(figure=figure, table=table, saved=save)
    if not result.certified:
        stop(1, "The bands are not certified: see the remarks.")


def _refuse_unused(options: dict[str, object]) -> None:
    """BadInput for an option that nothing uses without baselines."""
    for name, value in options.items():
        if value is not None:
            raise BadInput(f"Argument {name} must be used with --baselines.")


def _check_baselines(camera: CameraOptions, scale: "PhysicalScale | None", has_bands: bool) -> None:
    """BadInput if there can be no visibilities; has_bands: some band has two edges."""
    if not camera.is_observer:
        raise BadInput("Argument --baselines must be used with --observer or --radius inf: a camera measures angles.")
    if scale is not None and scale.distance is None:
        raise BadInput("Argument --mass must be used with --distance.")
    if not has_bands:
        raise BadInput("Argument --outer must be finite, or --max-order at least 1, for --baselines.")


def _turn(argument: str, degrees: float | None) -> float:
    """An angle in radians, 0 by default."""
    if degrees is not None and not math.isfinite(degrees):
        raise BadInput(f"Argument {argument} must be a finite number of degrees, but is {degrees:g}.")
    return math.radians(degrees or 0.0)


def _inner(text: str | None) -> float | str | None:
    """The inner radius, a number or isco."""
    if text is None or text == "isco":
        return text
    try:
        return float(text)
    except ValueError:
        raise BadInput(f"Argument --inner must be a radius or isco, but is {text}.") from None


def _lengths(text: str) -> list[float]:
    """Lengths of baselines: a number, or a range with even steps."""
    try:
        low, *rest = [float(part) for part in text.split(":")]
    except ValueError:
        raise BadInput(f"Argument --baselines must be a number or LOW:HIGH:COUNT, but is {text}.") from None
    if not rest and math.isfinite(low):
        return [low]
    count = int(rest[1]) if len(rest) > 1 and rest[1].is_integer() else _COUNT
    good = len(rest) in (1, 2) and 0 <= low < rest[0] < math.inf and (len(rest) < 2 or rest[1] == count)
    if not good or not 2 <= count <= _MOST_COUNT:
        raise BadInput(
            f"Argument --baselines must be LOW:HIGH:COUNT with 0 <= LOW < HIGH and a COUNT of 2 to {_MOST_COUNT}, but "
            f"is {text}."
        )
    return [low + (rest[0] - low) * i / (count - 1) for i in range(count)]


def _print(result: "PhotonRings", seen: "Visibilities | None", out: Console, scale: "PhysicalScale | None") -> None:
    flat = result.camera.sky_unit != "rad"
    say(out, f"{place_of(result.camera)}: matter from r = {result.inner:.9g} to {result.outer:.9g} in the plane")
    table = PlainTable(("n", f"solid angle ({'M^2' if flat else 'sr'})", "error", "certified"))
    for band in result:
        # An infinite one has no error.
        error = f"{band.solid_angle_error:.0e}" if math.isfinite(band.solid_angle) else "-"
        table.add_row(str(band.order), f"{band.solid_angle:.12g}", error, "yes" if band.certified else "no")
    out.print(table)
    edge = result.edge
    exponents = ("gamma", edge.lyapunov), ("delta", edge.rotation), ("tau", edge.delay)
    ranges = (f"{name} {value.min():.6g} to {value.max():.6g}" for name, value in exponents)
    say(out, f"from each order to the next along the shadow edge of {len(edge.sky)} points: {', '.join(ranges)}")
    if seen is not None:
        unit = "giga-wavelengths" if scale is not None else "cycles per M"
        sizes = ", ".join(f"n = {n}: {abs(row[-1]):.6g}" for n, row in zip(seen.order, seen.value, strict=True))
        say(
            out,
            f"|V| on the longest of {len(seen.u)} baselines, {math.hypot(seen.u[-1], seen.v[-1]):.6g} {unit}: {sizes}",
        )
    say_all(out, result.remarks)
    say(out, f"{len(result)} band{'s' * (len(result) > 1)}: {verdict(result.certified)}")
