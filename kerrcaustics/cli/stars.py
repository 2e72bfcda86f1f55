"""The commands `images` and `counts`: what caustics do to the stars."""

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import cyclopts
from rich.console import Console

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
    place_of,
    plain_errors,
    plain_table,
    progress,
    say,
    write_figure,
    write_found,
)

if TYPE_CHECKING:
    from kerrcaustics.spacetime.camera import Camera
    from kerrcaustics.stars.circles import CircleImages
    from kerrcaustics.stars.counts import CountMap, ImageCounts
    from kerrcaustics.stars.images import StarImages
    from kerrcaustics.stars.lines import LineCrossings

Angles = Annotated[tuple[float, float] | None, cyclopts.Parameter(allow_leading_hyphen=True)]
Flag = Annotated[bool, cyclopts.Parameter(negative=())]

_MOST_ROWS_PRINTED, _WIDE = 40, 112


@app.command
def images(
    *,
    spin: float,
    radius: float,
    star: Annotated[tuple[float, float], cyclopts.Parameter(allow_leading_hyphen=True)],
    inclination: float = 90.0,
    velocity: Velocity = None,
    max_index: WholeNumber = 2,
    json_: JsonTarget = None,
) -> None:
    """Find all images of a star up to a Morse index, and say whether none is missing.

    Parameters
    ----------
    spin
        Spin a of the hole, 0 <= a < 1.
    radius
        Boyer-Lindquist radius of the camera, in units of the mass.
    star
        The star's place on the celestial sphere: theta' from the spin axis and phi', degrees.
    inclination
        Angle of the camera from the spin axis, degrees: 90 is the equator.
    velocity
        Motion of the camera: on a circular geodesic orbit, with the fiducial observer, or static. By default
        circular where there is such an orbit, else fiducial.
    max_index
        Highest Morse index, 0 to 6: how often a beam of light was focused to a line on its way.
    json_
        Write the numbers to this file as JSON; - is standard output.
    """
    check_outputs({"--json": json_file(json_)})
    place = _radians("--star", star)
    camera = camera_at(spin, radius, inclination, velocity)
    began = time.perf_counter()
    with plain_errors(), progress():
        from kerrcaustics.stars.images import star_images

        found = star_images(camera, place, max_index)
    if json_ is not None:
        from kerrcaustics.results.records import record

        write_found(record(found, camera=camera), json_, time.perf_counter() - began)
    _print_images(camera, found, console(stderr=json_ == "-", width=_WIDE))
    if not found.certified:
        stop(1, "The images are not certified: see the remarks.")


@app.command
def counts(
    *,
    spin: float,
    radius: float,
    inclination: float = 90.0,
    velocity: Velocity = None,
    star: Angles = None,
    stars: Path | None = None,
    map_: Annotated[bool, cyclopts.Parameter(name="--map", negative=())] = False,
    circle: Angles = None,
    max_index: WholeNumber = 2,
    rows: WholeNumber = 180,
    line: Annotated[float | None, cyclopts.Parameter(allow_leading_hyphen=True)] = None,
    figure: Path | None = None,
    json_: JsonTarget = None,
    points: Flag = False,
) -> None:
    """Count the images of stars, over the whole celestial sphere, or of a great circle.

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
        circular where there is such an orbit, else fiducial. Counts do not depend on it.
    star
        Count the images of one star at theta', phi', degrees.
    stars
        Count those of many stars: a file with lines "theta,phi" in degrees; lines that begin with # are left out.
    map_
        Count on a grid over the celestial sphere, by the winding of the caustics.
    circle
        Find the images of a great circle, which are curves; given is its normal: theta', phi' in degrees.
    max_index
        Highest Morse index, 0 to 6.
    rows
        With --map: cells from pole to pole; twice as many go round.
    line
        With --circle: count the crossings with the line straight away from the shadow edge at this parameter, degrees:
        0 at the prograde edge, 180 at the retrograde one.
    figure
        With --map: draw the map with the caustics into this file: .png, .pdf or .svg.
    json_
        Write the numbers to this file as JSON; - is standard output.
    points
        With --circle: put the points of the curves into the JSON too.
    """
    kind = _one_kind({"--star": star, "--stars": stars, "--map": map_ or None, "--circle": circle})
    _only_with(kind, "--map", {"--figure": figure, "--rows": None if rows == 180 else rows})
    _only_with(kind, "--circle", {"--line": line, "--points": points or None})
    if line is not None and not math.isfinite(line):
        raise BadInput(f"Argument --line must be a finite number of degrees, but is {line:g}.")
    if points and json_ is None:
        raise BadInput("Argument --points must come with --json.")
    check_outputs({"--figure": figure, "--json": json_file(json_)})
    check_ending(figure)
    wanted = _radians("--star", star) if star else _radians("--circle", circle) if circle else None
    places = _read_stars(stars) if stars else [wanted]
    camera = camera_at(spin, radius, inclination, velocity)
    out = console(stderr=json_ == "-")
    began = time.perf_counter()
    if kind == "--map":
        entry, certified = _map(camera, max_index, rows, figure, out), True
    elif kind == "--circle":
        entry, certified = _circle(camera, wanted, max_index, line, points, out)
    else:
        entry, certified = _stars(camera, places, max_index, out)
    if json_ is not None:
        write_found(entry, json_, time.perf_counter() - began, None if points or kind == "--map" else 2)
    if not certified:
        stop(1, "Not all of it is certified: see the remarks.")


def _stars(camera: "Camera", places: Any, max_index: int, out: Console) -> tuple[dict[str, Any], bool]:
    with plain_errors(), progress():
        from kerrcaustics.results.records import record
        from kerrcaustics.stars.counts import image_counts

        found = image_counts(camera, places, max_index)
    _print_counts(camera, found, out)
    return record(found, camera=camera), found.all_certified


def _map(camera: "Camera", max_index: int, rows: int, figure: Path | None, out: Console) -> dict[str, Any]:
    with plain_errors(), progress() as report:
        from kerrcaustics.results.records import record
        from kerrcaustics.stars.counts import count_map

        found = count_map(camera, max_index, rows)
        if figure is not None:
            report("drawing", 0.9)
            from kerrcaustics.curves.caustic import caustics
            from kerrcaustics.draw.count_map import count_map_figure

            write_figure(count_map_figure(found, caustics(camera, max_index + 1)), figure)
    _print_map(camera, found, out)
    return record(found, camera=camera)


def _circle(
    camera: "Camera", normal: Any, max_index: int, line: float | None, points: bool, out: Console
) -> tuple[dict[str, Any], bool]:
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


def _radians(name: str, angles: tuple[float, float]) -> tuple[float, float]:
    theta, phi = angles
    if not 0 <= theta <= 180:
        raise BadInput(f"Argument {name} must have a theta' in [0, 180] degrees, but it is {theta:g}.")
    if not math.isfinite(phi):
        raise BadInput(f"Argument {name} must have a finite phi', but it is {phi:g}.")
    return math.radians(theta), math.radians(phi)


def _read_stars(path: Path) -> list[tuple[float, float]]:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise BadInput(f"Argument --stars must name a file that can be read: {path}: {reason}.") from None
    places = []
    for number, text in enumerate(lines, start=1):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        try:
            theta, phi = (float(word) for word in text.split(","))
        except ValueError:
            # A head line.
            if number == 1 and any(character.isalpha() for character in text):
                continue
            raise BadInput(
                f'Argument --stars must name a file of lines "theta,phi" in degrees, but line {number} of {path} is '
                f"{text.strip()[:60]!r}."
            ) from None
        places.append(_radians(f"--stars, line {number},", (theta, phi)))
    if not places:
        raise BadInput(f"Argument --stars must name a file with at least one star, but {path} has none.")
    return places


def _print_images(camera: "Camera", found: "StarImages", out: Console) -> None:
    theta, phi = (math.degrees(angle) for angle in found.star)
    say(out, f"{place_of(camera)}: images of the star at theta' = {theta:.12g}, phi' = {phi:.12g} deg")
    table = plain_table(
        ("index", "parity", "direction N", "phi' (deg)", "magnification", "crossings", "redshift", "error")
    )
    for i in range(len(found)):
        table.add_row(
            str(found.index[i]),
            "+" if found.parity[i] > 0 else "-",
            " ".join(f"{x:+.5f}" for x in found.sky[i]),
            f"{math.degrees(found.azimuth[i]):.3f}",
            f"{found.magnification[i]:.4g}",
            str(found.crossings[i]),
            f"{found.redshift[i]:.5f}",
            f"{found.error[i]:.0e}",
        )
    out.print(table)
    for remark in found.remarks:
        say(out, remark)
    total = ", ".join(f"{count} of index {k}" for k, count in found.per_index.items())
    say(out, f"{total}: {'certified' if found.certified else 'NOT certified'}; errors on the camera sky in radians")


def _print_counts(camera: "Camera", found: "ImageCounts", out: Console) -> None:
    say(out, f"{place_of(camera)}: image counts")
    indices = range(found.counts.shape[1])
    table = plain_table(("theta' (deg)", "phi' (deg)", *(f"index {k}" for k in indices), "total", ""))
    shown = range(min(len(found.stars), _MOST_ROWS_PRINTED))
    for i in shown:
        remark = "certified" if found.certified[i] else "on a caustic" if found.on_caustic[i] else "not certified"
        theta, phi = (f"{math.degrees(angle):.8g}" for angle in found.stars[i])
        table.add_row(theta, phi, *(str(found.counts[i, k]) for k in indices), str(found.counts[i].sum()), remark)
    out.print(table)
    if len(found.stars) > len(shown):
        say(out, f"... and {len(found.stars) - len(shown)} more stars: --json writes them all")
    say(
        out, f"{int(found.certified.sum())} of {len(found.stars)} certified, {int(found.on_caustic.sum())} on a caustic"
    )
    for i in [i for i in range(len(found.stars)) if not (found.certified[i] or found.on_caustic[i])][
        :_MOST_ROWS_PRINTED
    ]:
        say(out, f"star {i + 1}: found {found.counts[i].tolist()}, the caustics tell {found.expected[i].tolist()}")


def _print_map(camera: "Camera", found: "CountMap", out: Console) -> None:
    say(out, f"{place_of(camera)}: image counts over the celestial sphere")
    share = found.solid_angle[:, None, None] / (4 * math.pi)
    table = plain_table(("index", "fewest", "most", "mean"))
    for k in range(found.counts.shape[2]):
        layer = found.counts[..., k]
        table.add_row(str(k), str(layer.min()), str(layer.max()), f"{(layer[..., None] * share).sum():.4f}")
    total = found.counts.sum(axis=2)
    table.add_row("all", str(total.min()), str(total.max()), f"{(total[..., None] * share).sum():.4f}")
    out.print(table)


def _print_circle(found: "CircleImages", line: "LineCrossings | None", degrees: float | None, out: Console) -> None:
    theta, phi = (math.degrees(angle) for angle in found.normal)
    say(out, f"{place_of(found.camera)}: images of the great circle with normal {theta:.12g}, {phi:.12g} deg")
    table = plain_table(("index", "curve", "longitude from", "to (deg)", "error"))
    for curve in found.curves:
        first, last = math.degrees(curve.longitude[0]), math.degrees(curve.longitude[0] + curve.sweep)
        kind = "closed" if curve.closed else "open"
        table.add_row(str(curve.index), kind, f"{first:.5f}", f"{last:.5f}", f"{curve.error:.0e}")
    out.print(table)
    for remark in (*found.remarks, *(line.remarks if line else ())):
        say(out, remark)
    if line is not None:
        total = ", ".join(f"{count} of index {k}" for k, count in line.per_index.items())
        sure = "certified" if line.certified else "NOT certified"
        say(out, f"the line at {degrees:g} deg crosses images of the circle: {total}: {sure}")
    say(out, "curves certified" if found.certified else "curves NOT certified")
