"""The command `counts`: how many images stars have."""

import math
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import cyclopts
from rich.console import Console

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.options import (
    COMMON,
    SKY_SOURCES,
    Angle,
    Angles,
    CameraOptions,
    CommonOptions,
    FileName,
    Flag,
    MaxIndex,
    SourceOptions,
    WholeNumber,
)
from kerrcaustics.cli.outputs import check_ending, write_figure
from kerrcaustics.cli.tables import PlainTable, rows_of, table_of
from kerrcaustics.cli.terminal import (
    index_counts,
    place_cells,
    place_heads,
    place_of,
    plain_errors,
    progress,
    say,
    say_all,
    verdict,
)
from kerrcaustics.files import read_text

if TYPE_CHECKING:
    from kerrcaustics.beams.ends import Wherever
    from kerrcaustics.images.counts import CountMap, ImageCounts
    from kerrcaustics.spacetime.viewer import Viewer
    from kerrcaustics.tracks.circles import CircleImages

Places = list[tuple[float, float]]
Counted = tuple[dict[str, Any], bool, Callable[[Console], None]]
"""A record, its certificate, and the function that prints it."""

_ROWS = 180
_MOST_ROWS_PRINTED = 40
# Bytes of a file of stars.
_LONGEST = 100_000_000


@app.command(
    **with_examples(
        "counts --spin 0.999 --radius 2.6 --star 90 141", "counts --spin 0.999 --radius 6.03 --map --figure counts.png"
    )
)
def counts(
    *,
    camera: CameraOptions,
    star: Angles | None = None,
    stars: FileName | None = None,
    map_: Annotated[Flag, cyclopts.Parameter(name="--map")] = False,
    circle: Angles | None = None,
    max_index: MaxIndex = 2,
    rows: WholeNumber = _ROWS,
    line: Angle | None = None,
    figure: FileName | None = None,
    source: SourceOptions = SKY_SOURCES,
    common: CommonOptions = COMMON,
    points: Flag = False,
) -> None:
    """Count the images of single stars, of stars all over the celestial sphere, or of a great circle.

    Counts do not depend on the velocity of the camera.

    Parameters
    ----------
    star
        Count the images of one star at theta', phi', degrees; the camera lies at phi' = 0.
    stars
        Count the images of many stars: a file of lines "theta,phi" in degrees; lines that begin with # are skipped.
    map_
        Count on a grid over the celestial sphere, by the winding of the caustics; with --plane, over r and phi.
    circle
        Find the images (curves) of the great circle with this normal: theta', phi' in degrees.
    rows
        With --map: number of cells from pole to pole, with twice as many in phi'. With --plane: number of circles,
        each of which takes about one second.
    line
        With --circle: count the crossings with the line that starts at this point of the shadow edge, in degrees (0 at
        the prograde edge, 180 at the retrograde one), and runs straight away from the hole.
    figure
        With --map: save the map with the caustics to this file: .png, .pdf or .svg. With --circle: save the images of
        the circle, the crossings with the line if --line is given, and the circle among the caustics.
    points
        With --circle: include the points of the curves in the JSON.
    """
    kind = _one_kind({"--star": star, "--stars": stars, "--map": map_ or None, "--circle": circle})
    _only_with(kind, "--map", {"--rows": None if rows == _ROWS else rows})
    _only_with(kind, "--map or --circle", {"--figure": figure})
    _only_with(kind, "--circle", {"--line": line, "--points": points or None})
    if line is not None and not math.isfinite(line):
        raise BadInput(f"Argument --line must be a finite number of degrees, but is {line:g}.")
    common.check_points(points)
    common.check({"--figure": figure})
    check_ending(figure)
    if circle and source.plane is not None:
        raise BadInput("Argument --plane must not be used with --circle: great circles lie on a sphere.")
    places = _read_stars(stars, source) if stars else [source.place(kind, place) for place in (star, circle) if place]
    end, viewer = source.end(), camera.viewer(source.in_plane)
    began = time.perf_counter()
    with plain_errors({"stars": kind[2:]}), progress() as report:
        if circle:
            entry, certified, print_on = _circle(viewer, places[0], max_index, end, line, points, figure)
        elif map_:
            entry, certified, print_on = _map(viewer, max_index, rows, end, figure, report)
        else:
            entry, certified, print_on = _stars(viewer, places, max_index, end)
    print_on(common.console())
    common.say_files(figure=figure)
    common.write_result(entry, time.perf_counter() - began, None if points or map_ else 2)
    if not certified:
        stop(1, "Not everything is certified: see the remarks.")


def _stars(camera: "Viewer", places: Places, max_index: int, end: "Wherever") -> Counted:
    from kerrcaustics.images.counts import image_counts
    from kerrcaustics.results.records import record

    counts = image_counts(camera, places, max_index, end=end)
    return record(counts), counts.all_certified, partial(_print_counts, counts)


def _map(
    camera: "Viewer",
    max_index: int,
    rows: int,
    end: "Wherever",
    figure: Path | None,
    report: Callable[[str, float], None],
) -> Counted:
    from kerrcaustics.images.counts import count_map
    from kerrcaustics.results.records import record

    counts = count_map(camera, max_index, rows, end=end, progress=report)
    if figure is not None:
        report("drawing", 1.0)
        from kerrcaustics.curves.caustic_search import caustics
        from kerrcaustics.draw.count_map import count_map_figure

        write_figure(count_map_figure(counts, caustics(camera, max_index + 1, end=end)), figure)
    # Where the winding alone counts, nothing is certified, and nothing was to be.
    certified = bool((counts.certified | counts.on_caustic).all()) or not counts.certified.any()
    return record(counts), certified, partial(_print_map, counts)


def _circle(
    camera: "Viewer",
    normal: tuple[float, float],
    max_index: int,
    end: "Wherever",
    degrees: float | None,
    points: bool,
    figure: Path | None,
) -> Counted:
    from kerrcaustics.results.records import in_degrees, record
    from kerrcaustics.tracks.circles import circle_images
    from kerrcaustics.tracks.lines import crossings_of_line

    circle = circle_images(camera, normal, max_index, end=end)
    entry, lines, crossed = record(circle, points=points), [], {}
    if degrees is not None:
        turn = math.radians(degrees)
        crossed[turn] = crossings = crossings_of_line(circle, turn)
        inner = record(crossings)
        del inner["schema"]
        entry["certified"] &= crossings.certified
        entry["remarks"] += inner.pop("remarks")
        entry["line"] = {"turn_deg": in_degrees(turn), **inner}
        total = f"{index_counts(crossings.per_index)}: {verdict(crossings.certified)}"
        lines.append(f"the line at {degrees:zg} deg crosses images of the circle: {total}")
    if figure is not None:
        from kerrcaustics.curves.caustic_search import caustics
        from kerrcaustics.draw.circles import circle_figure

        write_figure(circle_figure(circle, caustics(camera, max_index + 1, end=end), crossed), figure)
    lines = [*entry["remarks"], *lines, f"curves {verdict(circle.certified)}"]
    return entry, entry["certified"], partial(_print_circle, circle, lines)


def _one_kind(given: dict[str, Any]) -> str:
    """The argument that was given; there must be exactly one."""
    kinds = [name for name, value in given.items() if value is not None]
    if len(kinds) != 1:
        which = f"{kinds[0]} and {kinds[1]} were given" if kinds else "none was given"
        raise BadInput(f"Arguments {', '.join(given)}: one of them must be given, but {which}.")
    return kinds[0]


def _only_with(kind: str, needed: str, given: dict[str, Any]) -> None:
    for name, value in given.items():
        if value is not None and kind not in needed.split(" or "):
            raise BadInput(f"Argument {name} must be used with {needed}.")


def _read_stars(path: Path, source: SourceOptions) -> Places:
    try:
        lines = read_text(path, _LONGEST).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise BadInput(f"Argument --stars must name a file that can be read: {path}: {reason}.") from None
    rows = [(number, text.strip()) for number, text in enumerate(lines, start=1)]
    rows = [(number, text) for number, text in rows if text and not text.startswith("#")]
    # A head line.
    if rows and rows[0][0] == 1 and _angles(rows[0][1]) is None and any(map(str.isalpha, rows[0][1])):
        del rows[0]
    places = []
    for number, text in rows:
        angles = _angles(text)
        if angles is None:
            line = f"line {number} of {path} is {text[:60]!r}"
            raise BadInput(f'Argument --stars must name a file of lines "theta,phi" in degrees, but {line}.')
        places.append(source.place(f"--stars, line {number},", angles))
    if not places:
        raise BadInput(f"Argument --stars must name a file with at least one star, but {path} has none.")
    return places


def _angles(text: str) -> tuple[float, float] | None:
    """The two numbers of a line; none where it has not two numbers."""
    try:
        theta, phi = (float(word) for word in text.split(","))
    except ValueError:
        return None
    return theta, phi


def _print_counts(counts: "ImageCounts", out: Console) -> None:
    surface, stars = counts.surface, rows_of(counts)
    say(out, f"{place_of(counts.camera)}: image counts on {surface.in_words()}")
    heads = (*place_heads(surface), *(f"index {k}" for k in range(counts.max_index + 1)), "total", "")
    table = PlainTable(heads)
    for star in stars[:_MOST_ROWS_PRINTED]:
        remark = "certified" if star.certified else "on a caustic" if star.on_caustic else "not certified"
        table.add_row(*place_cells(surface, star.stars), *map(str, (*star.counts, star.total)), remark)
    out.print(table)
    if len(stars) > _MOST_ROWS_PRINTED:
        say(out, f"... and {len(stars) - _MOST_ROWS_PRINTED} more stars: --json writes them all")
    say_all(out, counts.remarks)
    say(out, f"{counts.certified.sum()} of {len(stars)} certified")
    for i in (~(counts.certified | counts.on_caustic)).nonzero()[0][:_MOST_ROWS_PRINTED]:
        images, expected = counts.counts[i].tolist(), counts.expected[i].tolist()
        say(out, f"star {i + 1}: found {images}, the caustics require {expected}")


def _print_map(counts: "CountMap", out: Console) -> None:
    """Fewest, most and, over a sphere, mean of the counts of each index."""
    say(out, f"{place_of(counts.camera)}: image counts over {counts.surface.in_words()}")
    over_sphere = counts.surface.coordinates[0].unit == "rad"
    table = PlainTable(("index", "fewest", "most", *["mean"] * over_sphere))
    layers = {str(k): counts.counts[..., k] for k in range(counts.max_index + 1)} | {"all": counts.counts.sum(axis=2)}
    for name, layer in layers.items():
        mean = [f"{(layer * counts.solid_angle[:, None]).sum() / (4 * math.pi):.4f}"] if over_sphere else []
        table.add_row(name, str(layer.min()), str(layer.max()), *mean)
    out.print(table)
    say_all(out, counts.remarks)
    if counts.certified.any():
        say(out, f"{counts.certified.mean():.2%} of {counts.certified.size} places certified")


def _print_circle(circle: "CircleImages", lines: list[str], out: Console) -> None:
    theta, phi = (math.degrees(angle) for angle in circle.normal)
    where = f" on {circle.surface.in_words()}" if circle.surface.finite else ""
    say(out, f"{place_of(circle.camera)}: images of the great circle with normal {theta:z.12g}, {phi:z.12g} deg{where}")
    columns = {
        "index": "index",
        "curve": lambda curve: "closed" if curve.closed else "open",
        "longitude from": lambda curve: f"{math.degrees(curve.longitude[0]):z.5f}",
        "to (deg)": lambda curve: f"{math.degrees(curve.longitude[0] + curve.sweep):z.5f}",
        "error": "error:.0e",
    }
    out.print(table_of(circle.curves, columns))
    say_all(out, lines)
