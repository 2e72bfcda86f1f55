"""The command `tracks`: the images of a star over one orbit of the camera."""

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, cast

from rich.console import Console

from kerrcaustics.cli.app import BadInput, app, stop, with_examples
from kerrcaustics.cli.options import (
    COMMON,
    SKY_SOURCES,
    Angle,
    CameraOptions,
    CommonOptions,
    FileName,
    Flag,
    MaxIndex,
    SourceOptions,
)
from kerrcaustics.cli.outputs import check_ending, check_film, write_figure
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import place_in_words, place_of, plain_errors, progress, say, sure

if TYPE_CHECKING:
    from kerrcaustics.beams.ends import Spherical
    from kerrcaustics.curves.caustic import CausticSet
    from kerrcaustics.spacetime.viewer import Viewer
    from kerrcaustics.stars.tracks import StarTracks


@app.command(
    **with_examples(
        "tracks --spin 0.999 --radius 6.03 --star-theta 80 --figure tracks.png",
        "tracks --spin 0.9 --radius 10 --star-theta 85 --film tracks.mp4",
    )
)
def tracks(
    *,
    camera: CameraOptions,
    star_theta: Angle | None = None,
    orbit: float | None = None,
    max_index: MaxIndex = 2,
    figure: FileName | None = None,
    film: FileName | None = None,
    restart: Flag = False,
    source: SourceOptions = SKY_SOURCES,
    common: CommonOptions = COMMON,
) -> None:
    """Follow all images of a star over one orbit of the camera, with the creation and annihilation of pairs.

    The camera must orbit the spin axis: static is refused. For an observer at infinity the star goes round.

    Parameters
    ----------
    star_theta
        The star's angle theta' from the spin axis, degrees. Its phi' runs through a whole turn.
    orbit
        With --plane, instead: radius of the circle in the equatorial plane that the star runs round, in units of the
        mass. The camera may be static.
    figure
        Draw the tracks, the events and the brightness into this file: .png, .pdf or .svg.
    film
        Write a film of the orbit into this file: .mp4 or .gif. It takes minutes; started again after an interruption,
        it goes on where it stopped.
    restart
        Throw away frames of an unfinished film that are there, and draw all anew.
    """
    common.check({"--figure": figure, "--film": film})
    check_ending(figure)
    check_film(film)
    if source.plane is not None:
        _only_a_circle(star_theta, film)
        _in_plane(camera.camera(), orbit, max_index, figure, source, common)
        return
    theta, sphere = _checked(star_theta, orbit), source.sphere()
    seen_from = camera.viewer()
    _check_orbit(seen_from)
    for argument, picture in (("--figure", figure), ("--film", film)):
        if math.isinf(seen_from.radius) and picture is not None:
            raise BadInput(f"Argument {argument} must be left out for an observer at infinity.")
    began = time.perf_counter()
    with plain_errors({"level": "star-theta"}), progress() as report:
        from kerrcaustics.results.records import record
        from kerrcaustics.stars.tracks import star_tracks

        found = star_tracks(seen_from, math.radians(theta), max_index, end=sphere)
        seconds = time.perf_counter() - began
        if figure is not None:
            report("drawing", 0.9)
            _draw(found, figure)
    if film is not None:
        _write_film(found, film, restart)
    common.write_found(record(found), seconds, None)
    _print_tracks(found, common.console())
    if not found.certified:
        stop(1, "The tracks are not certified: see the remarks.")


def _checked(star_theta: float | None, orbit: float | None) -> float:
    """The angle of a star on a sphere, degrees."""
    if orbit is not None:
        raise BadInput("Argument --orbit must come with --plane.")
    if star_theta is None:
        raise BadInput("Argument --star-theta must be given.")
    if not 0 <= star_theta <= 180:
        raise BadInput(f"Argument --star-theta must lie in [0, 180] degrees, but is {star_theta:g}.")
    return star_theta


def _only_a_circle(star_theta: float | None, film: Path | None) -> None:
    for name, value in (("--star-theta", star_theta), ("--film", film)):
        if value is not None:
            raise BadInput(f"Argument {name} must not come with --plane.")


def _in_plane(
    camera: "Viewer",
    orbit: float | None,
    max_index: int,
    figure: Path | None,
    source: SourceOptions,
    common: CommonOptions,
) -> None:
    """The tracks of a source that circles in the plane."""
    if orbit is None:
        raise BadInput("Argument --orbit must be given with --plane.")
    began = time.perf_counter()
    with plain_errors({"level": "orbit"}), progress() as report:
        from kerrcaustics.results.records import record
        from kerrcaustics.stars.tracks import star_tracks

        found = star_tracks(camera, orbit, max_index, end=source.end())
        seconds = time.perf_counter() - began
        if figure is not None:
            report("drawing", 0.9)
            from kerrcaustics.draw.tracks import tracks_figure

            write_figure(tracks_figure(found), figure)
    common.write_found(record(found), seconds, None)
    _print_tracks(found, common.console())
    if not found.certified:
        stop(1, "The tracks are not certified: see the remarks.")


def _caustics(found: "StarTracks") -> "CausticSet":
    from kerrcaustics.curves.caustic import caustics

    return caustics(found.camera, found.max_index + 1, end=cast("Spherical", found.surface))


def _draw(found: "StarTracks", path: Path) -> None:
    from kerrcaustics.draw.tracks import tracks_figure

    write_figure(tracks_figure(found, _caustics(found)), path)


def _write_film(found: "StarTracks", path: Path, restart: bool) -> None:
    from kerrcaustics.cli.film import filmed
    from kerrcaustics.draw.orbit_films import orbit_film

    with progress(left=True) as report:
        film = orbit_film(found, _caustics(found))
        made = filmed(path, film, report, restart=restart)
    if made.output is None:
        stop(1, made.complaint)


def _check_orbit(camera: "Viewer") -> None:
    """Refuse a camera that stands still, before any work is done."""
    try:
        camera.orbital_velocity()
    except ValueError:
        raise BadInput(
            f"Argument --velocity must make the camera orbit the spin axis, but this one does not: {place_of(camera)}."
        ) from None


def _print_tracks(found: "StarTracks", out: Console) -> None:
    place = place_in_words(found.surface, [found.level])
    say(out, f"{place_of(found.camera)}: tracks of a source at {place} on {found.surface.in_words()}")
    _print_curves(found, out)
    if found.events:
        _print_events(found, out)
    for remark in found.remarks:
        say(out, remark)
    total = f"{len(found.tracks)} tracks, {len(found.events)} events"
    if not found.angular_velocity:
        say(out, f"{total} in one turn of phi: {sure(found.certified)}; errors are those of phi in radians")
        return
    say(out, f"{total} in a period of {found.period:.9g}: {sure(found.certified)};")
    say(out, "time 0 is when the star's phi' is that of the camera; errors are those of phi' in radians")


def _print_curves(found: "StarTracks", out: Console) -> None:
    table = PlainTable(("track", "index", "points", "turns in phi'", "events"))
    for i, track in enumerate(found.tracks, start=1):
        # At the ends of an open track the index is that of the images beyond.
        low, high = track.index.min(), min(track.index.max(), found.max_index)
        turns = str(track.turns) if track.closed else "open"
        index = f"{low} to {high}" if low < high else str(low)
        table.add_row(str(i), index, str(len(track)), turns, str(len(track.events)))
    out.print(table)


def _print_events(found: "StarTracks", out: Console) -> None:
    # Without an orbit there is no time.
    timed = ["time"] if found.angular_velocity else []
    table = PlainTable((*timed, "event", "of index", "phi' (deg)", found.camera.sky_coordinates, "error"))
    for event in found.events:
        table.add_row(
            *(f"{event.moment:z.9g}" for _ in timed),
            event.kind,
            f"{event.indices[0]}, {event.indices[1]}",
            f"{math.degrees(event.azimuth):z.8f}",
            " ".join(f"{x:+z.5f}" for x in event.sky),
            f"{event.error:.0e}",
        )
    out.print(table)
