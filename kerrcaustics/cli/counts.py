"""The command `counts`: how many images stars have."""

import math
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import cyclopts
from rich.console import Console

from kerrcaustics.cli.app import BadInput, app, stop, with_examples
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
    radians,
)
from kerrcaustics.cli.outputs import check_ending, write_figure
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import counted, place_cells, place_heads, place_of, plain_errors, progress, say, sure
from kerrcaustics.files import read_text

if TYPE_CHECKING:
    import numpy as np

    from kerrcaustics.beams.ends import EquatorialPlane
    from kerrcaustics.spacetime.viewer import Viewer
    from kerrcaustics.stars.circles import CircleImages
    from kerrcaustics.stars.counts import CountMap, ImageCounts
    from kerrcaustics.stars.lines import LineCrossings

Counted = tuple[dict[str, Any], bool]

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
    """Count the images of stars, over the whole celestial sphere, or of a great circle.

    Counts do not depend on the velocity of the camera.

    Parameters
    ----------
    star
        Count the images of one star at theta', phi', degrees.
    stars
        Count those of many stars: a file with lines "theta,phi" in degrees; lines that begin with # are left out.
    map_
        Count on a grid over the celestial sphere, by the winding of the caustics; with --plane over r and phi.
    circle
        Find the images of a great circle, which are curves; given is its normal: theta', phi' in degrees.
    rows
        With --map: cells from pole to pole; twice as many go round. In the plane: circles, of about a second each.
    line
        With --circle: count the crossings with the line straight away from the shadow edge at this parameter, degrees:
        0 at the prograde edge, 180 at the retrograde one.
    figure
        With --map: draw the map with the caustics into this file: .png, .pdf or .svg.
    points
        With --circle: put the points of the curves into the JSON too.
    """
    kind = _one_kind({"--star": star, "--stars": stars, "--map": map_ or None, "--circle": circle})
    _only_with(kind, "--map", {"--figure": figure, "--rows": None if rows == _ROWS else rows})
    _only_with(kind, "--circle", {"--line": line, "--points": points or None})
    if line is not None and not math.isfinite(line):
        raise BadInput(f"Argument --line must be a finite number of degrees, but is {line:g}.")
    common.check_points(points)
    common.check({"--figure": figure})
    check_ending(figure)
    places: list[tuple[float, float]] = []
    if stars:
        places = _read_stars(stars, source)
    elif star:
        places = [source.place("--star", star)]
    count = (
        partial(_stars, places, "stars" if stars else "star", source.end())
        if places
        else partial(_map, rows, source.end(), figure)
    )
    if circle:
        if source != SKY_SOURCES:
            raise BadInput("Arguments --source-radius and --plane must not come with --circle.")
        count = partial(_circle, radians("--circle", circle), line, points)
    seen_from = camera.camera() if circle else camera.viewer()
    began = time.perf_counter()
    entry, certified = count(seen_from, max_index, common.console())
    common.write_found(entry, time.perf_counter() - began, None if points or map_ else 2)
    if not certified:
        stop(1, "Not all of it is certified: see the remarks.")


def _stars(
    places: list[tuple[float, float]],
    argument: str,
    end: "float | EquatorialPlane",
    camera: "Viewer",
    max_index: int,
    out: Console,
) -> Counted:
    with plain_errors({"stars": argument}), progress():
        from kerrcaustics.results.records import record
        from kerrcaustics.stars.counts import image_counts

        found = image_counts(camera, places, max_index, end=end)
    _print_counts(found, out)
    return record(found), found.all_certified


def _map(
    rows: int,
    end: "float | EquatorialPlane",
    figure: Path | None,
    camera: "Viewer",
    max_index: int,
    out: Console,
) -> Counted:
    with plain_errors(), progress() as report:
        from kerrcaustics.results.records import record
        from kerrcaustics.stars.counts import count_map

        found = count_map(camera, max_index, rows, end=end)
        if figure is not None:
            report("drawing", 0.9)
            from kerrcaustics.curves.caustic_search import caustics
            from kerrcaustics.draw.count_map import count_map_figure

            write_figure(count_map_figure(found, caustics(camera, max_index + 1, end=end)), figure)
    _print_map(found, out)
    # Where the winding alone counts, nothing is certified, and nothing was to be.
    return record(found), bool((found.certified | found.on_caustic).all()) or not found.certified.any()


def _circle(
    normal: tuple[float, float], line: float | None, points: bool, camera: "Viewer", max_index: int, out: Console
) -> Counted:
    turn = math.radians(line or 0.0)
    with plain_errors(), progress():
        from kerrcaustics.results.records import in_degrees, record
        from kerrcaustics.stars.circles import circle_images
        from kerrcaustics.stars.lines import crossings_of_line

        found = circle_images(camera, normal, max_index)
        crossed = None if line is None else crossings_of_line(found, turn)
    _print_circle(found, crossed, line, out)
    entry = record(found, points=points)
    if crossed is not None:
        inner = record(crossed)
        del inner["schema"]
        entry["certified"] &= crossed.certified
        entry["remarks"] += inner.pop("remarks")
        entry["line"] = {"turn_deg": in_degrees(turn), **inner}
    return entry, entry["certified"]


def _one_kind(given: dict[str, Any]) -> str:
    """Which of the arguments was given; it must be one."""
    kinds = [name for name, value in given.items() if value is not None]
    if len(kinds) != 1:
        which = f"{kinds[0]} and {kinds[1]} were given" if kinds else "none was given"
        raise BadInput(f"Arguments {', '.join(given)}: one of them must be given, but {which}.")
    return kinds[0]


def _only_with(kind: str, needed: str, given: dict[str, Any]) -> None:
    for name, value in given.items():
        if value is not None and kind != needed:
            raise BadInput(f"Argument {name} must come with {needed}.")


def _read_stars(path: Path, source: SourceOptions) -> list[tuple[float, float]]:
    try:
        lines = read_text(path, _LONGEST).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise BadInput(f"Argument --stars must name a file that can be read: {path}: {reason}.") from None
    told = [(number, text.strip()) for number, text in enumerate(lines, start=1)]
    told = [(number, text) for number, text in told if text and not text.startswith("#")]
    # A head line.
    if told and told[0][0] == 1 and _angles(told[0][1]) is None and any(map(str.isalpha, told[0][1])):
        del told[0]
    places = []
    for number, text in told:
        angles = _angles(text)
        if angles is None:
            where = f"line {number} of {path} is {text[:60]!r}"
            raise BadInput(f'Argument --stars must name a file of lines "theta,phi" in degrees, but {where}.')
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


def _print_counts(found: "ImageCounts", out: Console) -> None:
    say(out, f"{place_of(found.camera)}: image counts on {found.surface.in_words()}")
    indices = range(found.counts.shape[1])
    table = PlainTable((*place_heads(found.surface), *(f"index {k}" for k in indices), "total", ""))
    shown = range(min(len(found.stars), _MOST_ROWS_PRINTED))
    for i in shown:
        remark = "certified" if found.certified[i] else "on a caustic" if found.on_caustic[i] else "not certified"
        counts = (str(found.counts[i, k]) for k in indices)
        table.add_row(*place_cells(found.surface, found.stars[i]), *counts, str(found.counts[i].sum()), remark)
    out.print(table)
    if len(found.stars) > len(shown):
        say(out, f"... and {len(found.stars) - len(shown)} more stars: --json writes them all")
    _print_note(found, out)
    certified, apart = int(found.certified.sum()), int(found.on_caustic.sum())
    say(out, f"{certified} of {len(found.stars)} certified, {apart} on a caustic")
    for i in (~(found.certified | found.on_caustic)).nonzero()[0][:_MOST_ROWS_PRINTED]:
        say(out, f"star {i + 1}: found {found.counts[i].tolist()}, the caustics tell {found.expected[i].tolist()}")


def _print_note(found: "ImageCounts | CountMap", out: Console) -> None:
    if math.isinf(found.camera.radius) and not found.surface.finite:
        say(out, "stars are seen directly, by images of index 0, at infinite (alpha, beta): these are not counted")


def _print_map(found: "CountMap", out: Console) -> None:
    say(out, f"{place_of(found.camera)}: image counts over {found.surface.in_words()}")
    over_sphere = found.surface.coordinates[0].unit == "rad"
    _print_layers(found.counts, found.solid_angle[:, None] / (4 * math.pi) if over_sphere else None, out)
    _print_note(found, out)
    if found.certified.any():
        say(out, f"{found.certified.mean():.2%} of {found.certified.size} places certified")


def _print_layers(counts: "np.ndarray", share: "np.ndarray | None", out: Console) -> None:
    """Fewest, most and mean of a map's counts, by index; share: of each cell in the whole, None for no mean."""
    table = PlainTable(("index", "fewest", "most", *(() if share is None else ("mean",))))
    layers = {str(k): counts[..., k] for k in range(counts.shape[2])} | {"all": counts.sum(axis=2)}
    for name, layer in layers.items():
        mean = () if share is None else (f"{(layer * share).sum():.4f}",)
        table.add_row(name, str(layer.min()), str(layer.max()), *mean)
    out.print(table)


def _print_circle(found: "CircleImages", line: "LineCrossings | None", degrees: float | None, out: Console) -> None:
    theta, phi = (math.degrees(angle) for angle in found.normal)
    say(out, f"{place_of(found.camera)}: images of the great circle with normal {theta:z.12g}, {phi:z.12g} deg")
    table = PlainTable(("index", "curve", "longitude from", "to (deg)", "error"))
    for curve in found.curves:
        first, last = math.degrees(curve.longitude[0]), math.degrees(curve.longitude[0] + curve.sweep)
        kind = "closed" if curve.closed else "open"
        table.add_row(str(curve.index), kind, f"{first:z.5f}", f"{last:z.5f}", f"{curve.error:.0e}")
    out.print(table)
    for remark in (*found.remarks, *(line.remarks if line else ())):
        say(out, remark)
    if line is not None:
        total = f"{counted(line.per_index)}: {sure(line.certified)}"
        say(out, f"the line at {degrees:zg} deg crosses images of the circle: {total}")
    say(out, f"curves {sure(found.certified)}")
