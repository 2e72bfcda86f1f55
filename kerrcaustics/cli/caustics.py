"""The commands `caustics` and `demo`."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from kerrcaustics.choices import EngineName
from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.options import (
    COMMON,
    SKY_SOURCES,
    CameraOptions,
    CommonOptions,
    FileName,
    Flag,
    Orders,
    SourceOptions,
)
from kerrcaustics.cli.outputs import check_ending, make_folder, write_figure
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import place_of, plain_errors, progress, say, say_all

if TYPE_CHECKING:
    from kerrcaustics.curves.caustic import CausticSet

# The unrolled sky shows distances from the edge down to 1e-9 rad: a spline through as many points is good to 1e-15.
_EDGE_POINTS = 6000
_DEMO_SPIN, _DEMO_RADII = 0.999, (6.03, 2.6)


@app.command(
    **with_examples(
        "caustics --spin 0.999 --radius 6.03 --figure caustics.png",
        "caustics --spin 0.9 --radius inf --inclination 60 --json caustics.json",
    )
)
def caustics(
    *,
    camera: CameraOptions,
    orders: Orders = 3,
    engine: EngineName = "auto",
    figure: FileName | None = None,
    save: FileName | None = None,
    source: SourceOptions = SKY_SOURCES,
    common: CommonOptions = COMMON,
    points: Flag = False,
) -> None:
    """Find the critical curves and caustics that a camera sees, and print, draw or save them.

    The caustics do not depend on the velocity of the camera.

    Parameters
    ----------
    orders
        Number of caustics: 1 for the primary alone, 2 to add the secondary, 3 to add the tertiary, and so on.
    engine
        Engine that traces the beams.
    figure
        Save a plot of the caustics to this file: .png, .pdf or .svg.
    save
        Save everything to this file, which kerrcaustics.load reads.
    points
        Include the points of the curves in the JSON.
    """
    common.check({"--figure": figure, "--save": save})
    check_ending(figure)
    common.check_points(points)
    end = source.end()
    if source.plane is not None and figure is not None:
        raise BadInput("Argument --figure must not be used with --plane.")
    viewer = camera.viewer(source.in_plane)
    with plain_errors(), progress() as report:
        from kerrcaustics.curves.caustic_search import caustics as find
        from kerrcaustics.results import storage
        from kerrcaustics.results.records import record

        curves = find(viewer, orders, engine, progress=report, end=end)
    common.write(record(curves, points=points), None if points else 2)
    if save is not None:
        storage.save(save, curves)
    if figure is not None:
        _draw(curves, figure)
    (_print_table if source.plane is None else _print_plane)(curves, common.console())
    common.say_files(figure=figure, saved=save)
    if curves.lost:
        names = ", ".join(map(str, curves.lost))
        stop(1, f"Orders not found within double precision: {names}.")


@app.command(**with_examples("demo", "demo --output pictures"))
def demo(*, output: FileName = Path("demo"), common: CommonOptions = COMMON) -> None:
    """Compute and draw the first three caustics for a = 0.999 at r = 6.03 and at r = 2.6 (JTFT figs 4, 5, 8, 9).

    Beside the pictures lies a page, explorer.html, on which a star can be dragged over caustics.

    Parameters
    ----------
    output
        Folder for the pictures and the page; created if missing.
    """
    make_folder(output)
    pictures = [output / f"caustics_a{_DEMO_SPIN}_r{radius}.png" for radius in _DEMO_RADII]
    common.check({"--output": pictures[0]})
    out = common.console()
    records = []
    for radius, picture in zip(_DEMO_RADII, pictures, strict=True):
        with progress(f"r = {radius}: ") as report:
            from kerrcaustics.curves.caustic_search import caustics as find
            from kerrcaustics.results.records import record
            from kerrcaustics.spacetime.camera import Camera

            curves = find(Camera(_DEMO_SPIN, radius), 3, progress=report)
            report("drawing", 1.0)
            _draw(curves, picture)
        _print_table(curves, out)
        records.append(record(curves))
    page = _write_page(output / "explorer.html")
    files = {"pictures": [str(path) for path in pictures], "page": str(page)}
    common.write({"schema": "kerrcaustics/demo/1", "caustics": records, **files})
    out.print("Pictures:")
    for picture in pictures:
        say(out, f"  {picture}")
    say(out, f"Drag a star over the caustics, in a browser: {page}")
    say(out, "Now find all images of a star in a caustic: kerrcaustics images --spin 0.999 --radius 2.6 --star 90 141")


def _write_page(path: Path) -> Path:
    from kerrcaustics.explorer.still_page import write_page

    with plain_errors():
        write_page(path)
    return path


def _draw(curves: "CausticSet", path: Path) -> None:
    from kerrcaustics.draw.plots import overview
    from kerrcaustics.spacetime.shadow import shadow_edge

    write_figure(overview(curves, shadow_edge(curves.camera, _EDGE_POINTS)), path)


def _remark_on_primary(curves: "CausticSet") -> str:
    """A line on the primary caustic where there is none, and how to see others if there are none either."""
    if math.isfinite(curves.camera.radius) or curves.surface.finite or any(curve.order == 1 for curve in curves):
        return ""
    others = "" if curves or curves.lost else ": --orders 2 finds the secondary"
    return f"An observer at infinity sees no primary critical curve, and there is no primary caustic{others}."


def _print_table(curves: "CausticSet", out: Console) -> None:
    say(out, f"{place_of(curves.camera)}: full extents of the caustics on {curves.surface.in_words()}")
    heads = ("order", "kind", "theta' (deg)", "phi' (deg)", "circuits", "cusps", "error (deg)")
    table = PlainTable(heads, words=("kind",))
    for curve in curves:
        table.add_row(
            str(curve.order),
            curve.kind,
            _sized(curve.theta_extent, curve.error),
            _sized(curve.phi_extent, curve.error),
            f"{curve.circuits:.4f}",
            str(len(curve.cusps)),
            f"{math.degrees(curve.error):.0e}",
        )
    if len(curves):
        out.print(table)
    say_all(out, filter(None, [_remark_on_primary(curves), *curves.remarks]))
    residual = max((curve.residual for curve in curves), default=0.0)
    effort = f"{curves.seconds:.2f} s, {curves.beams} beams ({curves.engine})"
    say(out, f"{effort}, delta_minus / delta_plus at most {residual:.0e}")


def _sized(angle: float, error: float) -> str:
    """An angle in degrees with the digits that its error leaves, ten at most."""
    value, doubt = math.degrees(angle), math.degrees(error)
    if value < 1e-4:
        return f"{value:.2e}"
    digits = min(math.floor(-math.log10(doubt)), 9 - math.floor(math.log10(value)))
    return f"{value:.{max(digits, 0)}f}"


def _print_plane(curves: "CausticSet", out: Console) -> None:
    say(out, f"{place_of(curves.camera)}: caustics on {curves.surface.in_words()}")
    table = PlainTable(("order", "r from", "to", "phi from", "to (deg)", "ends", "error"), words=("ends",))
    for curve in curves:
        phi = (f"{math.degrees(angle):z.4f}" for angle in (curve.phi_min, curve.phi_max))
        ends = ", ".join(curve.ends) or "closed"
        table.add_row(str(curve.order), f"{curve.r_min:.6g}", f"{curve.r_max:.6g}", *phi, ends, f"{curve.error:.0e}")
    out.print(table)
    say_all(out, curves.remarks)
    if not len(curves):
        say(out, "none")
