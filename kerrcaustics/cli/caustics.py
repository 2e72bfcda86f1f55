"""The commands `caustics` and `demo`."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import cyclopts
from rich import box
from rich.console import Console
from rich.table import Table

from kerrcaustics.cli.app import BadInput, app, stop
from kerrcaustics.cli.options import (
    JsonTarget,
    Velocity,
    WholeNumber,
    camera_at,
    check_ending,
    check_outputs,
    console,
    json_file,
    make_folder,
    place_of,
    plain_errors,
    progress,
    write_figure,
    write_json,
)

if TYPE_CHECKING:
    from kerrcaustics.curves.caustic import CausticSet

# The unrolled sky shows distances from the edge down to 1e-9 rad: a spline through as many points is good to 1e-15.
_EDGE_POINTS = 6000
_DEMO_SPIN, _DEMO_RADII = 0.999, (6.03, 2.6)


@app.command
def caustics(
    *,
    spin: float,
    radius: float,
    inclination: float = 90.0,
    velocity: Velocity = None,
    orders: WholeNumber = 3,
    engine: Literal["auto", "closed-form", "integrated"] = "auto",
    tolerance: float = 1e-12,
    figure: Path | None = None,
    save: Path | None = None,
    json_: JsonTarget = None,
    points: Annotated[bool, cyclopts.Parameter(negative=())] = False,
) -> None:
    """Find the critical curves and caustics that a camera sees, and print, draw or save them.

    Parameters
    ----------
    spin
        Spin a of the hole, 0 <= a < 1.
    radius
        Boyer-Lindquist radius of the camera, in units of the mass.
    inclination
        Angle of the camera from the spin axis, degrees: 90 is the equator.
    velocity
        Motion of the camera: on a circular geodesic orbit, with the fiducial observer, or static. By default
        circular where there is such an orbit, else fiducial. The caustics do not depend on it.
    orders
        How many caustics: 1 primary, 2 secondary, 3 tertiary, and on.
    engine
        What traces the beams.
    tolerance
        Wanted error of a beam, radians.
    figure
        Draw them into this file: .png, .pdf or .svg.
    save
        Save everything into this file, to be loaded with kerrcaustics.load.
    json_
        Write the numbers to this file as JSON; - is standard output.
    points
        Put the points of the curves into the JSON too.
    """
    check_outputs({"--figure": figure, "--save": save, "--json": json_file(json_)})
    check_ending(figure)
    if points and json_ is None:
        raise BadInput("Argument --points must come with --json.")
    camera = camera_at(spin, radius, inclination, velocity)
    with plain_errors(), progress() as report:
        from kerrcaustics.curves.caustic import caustics as find

        found = find(camera, orders, engine, tolerance, progress=report)
    if json_ is not None:
        from kerrcaustics.results.records import record

        write_json(record(found, points=points), json_, None if points else 2)
    if save is not None:
        from kerrcaustics.results.files import save as write

        write(save, found)
    if figure is not None:
        _draw(found, figure)
    _print_table(found, console(stderr=json_ == "-"))
    if found.missing:
        names = ", ".join(map(str, found.missing))
        stop(1, f"Orders not found within double precision: {names}.")


@app.command
def demo(*, output: Path = Path("demo")) -> None:
    """Compute and draw the first three caustics of a = 0.999 at r = 6.03 and at r = 2.6 (JTFT figs 4, 5, 8, 9).

    Parameters
    ----------
    output
        Folder for the pictures; it is made when missing.
    """
    make_folder(output)
    pictures = [output / f"caustics_a{_DEMO_SPIN}_r{radius}.png" for radius in _DEMO_RADII]
    check_outputs({"--output": pictures[0]})
    out = console()
    for radius, picture in zip(_DEMO_RADII, pictures, strict=True):
        with progress(f"r = {radius}: ") as report:
            from kerrcaustics.curves.caustic import caustics as find
            from kerrcaustics.spacetime.camera import Camera

            found = find(Camera(_DEMO_SPIN, radius), 3, progress=report)
            report("drawing", 0.9)
            _draw(found, picture)
        _print_table(found, out)
    out.print("Pictures:")
    for picture in pictures:
        out.print(f"  {picture}", soft_wrap=True, highlight=False)


def _draw(found: "CausticSet", path: Path) -> None:
    from kerrcaustics.draw.plots import overview
    from kerrcaustics.spacetime.shadow import shadow_edge

    write_figure(overview(found, shadow_edge(found.camera, _EDGE_POINTS)), path)


def _print_table(found: "CausticSet", out: Console) -> None:
    out.print(f"{place_of(found.camera)}: full extents of the caustics", soft_wrap=True, highlight=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("order", "kind", "theta' (deg)", "phi' (deg)", "circuits", "cusps", "error (deg)"):
        table.add_column(name, justify="left" if name == "kind" else "right", no_wrap=True)
    for curve in found:
        table.add_row(
            str(curve.order),
            curve.kind,
            _sized(curve.theta_extent, curve.error),
            _sized(curve.phi_extent, curve.error),
            f"{curve.circuits:.4f}",
            str(len(curve.cusps)),
            f"{math.degrees(curve.error):.0e}",
        )
    out.print(table)
    for curve in found:
        for remark in curve.remarks:
            out.print(f"order {curve.order}: {remark}", soft_wrap=True, highlight=False)
    for order in found.missing:
        out.print(f"order {order}: not found", soft_wrap=True, highlight=False)
    residual = max((curve.residual for curve in found), default=0.0)
    out.print(
        f"{found.seconds:.2f} s, {found.beams} beams ({found.engine}), delta_minus / delta_plus at most {residual:.0e}",
        soft_wrap=True,
        highlight=False,
    )


def _sized(angle: float, error: float) -> str:
    """An angle in degrees with the digits that its error leaves, ten at most."""
    value, doubt = math.degrees(angle), math.degrees(error)
    if value < 1e-4:
        return f"{value:.2e}"
    digits = min(math.floor(-math.log10(doubt)), 9 - math.floor(math.log10(value)))
    return f"{value:.{max(digits, 0)}f}"
