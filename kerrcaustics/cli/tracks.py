"""The command `tracks`: the images of a star over one orbit of the camera."""

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.film import write_film
from kerrcaustics.cli.options import (
    COMMON,
    SKY_SOURCES,
    CameraOptions,
    CommonOptions,
    FileName,
    Flag,
    MaxIndex,
    PolarAngle,
    SourceOptions,
)
from kerrcaustics.cli.outputs import check_ending, check_film, write_figure
from kerrcaustics.cli.tables import PlainTable, table_of
from kerrcaustics.cli.terminal import place_in_words, place_of, plain_errors, progress, say, say_all, verdict

if TYPE_CHECKING:
    from kerrcaustics.curves.caustic import CausticSet
    from kerrcaustics.spacetime.viewer import Viewer
    from kerrcaustics.tracks.tracks import StarTracks


@app.command(
    **with_examples(
        "tracks --spin 0.999 --radius 6.03 --star-theta 80 --figure tracks.png",
        "tracks --spin 0.9 --radius 10 --star-theta 85 --film tracks.mp4",
    )
)
def tracks(
    *,
    camera: CameraOptions,
    star_theta: PolarAngle | None = None,
    orbit: float | None = None,
    max_index: MaxIndex = 2,
    figure: FileName | None = None,
    film: FileName | None = None,
    restart: Flag = False,
    source: SourceOptions = SKY_SOURCES,
    common: CommonOptions = COMMON,
) -> None:
    """Follow all images of a star over one orbit of the camera, with the creation and annihilation of pairs.

    The camera must orbit the spin axis; it cannot be static. An observer does not orbit: the star circles instead.

    Parameters
    ----------
    star_theta
        The star's angle theta' from the spin axis, degrees. Its phi' runs through a whole turn.
    orbit
        With --plane, instead of --star-theta: radius of the star's circle in the equatorial plane, in units of the
        mass. The camera may be static.
    figure
        Save a plot of the tracks, the events and the brightness to this file: .png, .pdf or .svg.
    film
        Write a film of the orbit, or of the star's circle, to this file: .mp4 or .gif. This takes minutes; an
        interrupted film resumes when the command is run again.
    restart
        Discard the existing frames of an unfinished film and draw all of them again.
    """
    common.check({"--figure": figure, "--film": film})
    check_ending(figure)
    check_film(film, restart=restart)
    argument, level = _level(star_theta, orbit, film, source)
    end, viewer = source.end(), camera.viewer(source.in_plane)
    if source.plane is None:
        _check_orbit(viewer)
    began = time.perf_counter()
    with plain_errors({"level": argument}), progress() as report:
        from kerrcaustics.results.records import record
        from kerrcaustics.tracks.tracks import star_tracks

        tracks = star_tracks(viewer, level, max_index, end=end, progress=report)
        seconds = time.perf_counter() - began
        if figure is not None:
            report("drawing", 1.0)
            from kerrcaustics.draw.track_figure import tracks_figure

            write_figure(tracks_figure(tracks, _caustics(tracks) if source.plane is None else None), figure)
    if film is not None:
        from kerrcaustics.draw.orbit_films import orbit_film

        write_film(film, lambda: orbit_film(tracks, _caustics(tracks)), restart)
    common.write_result(record(tracks), seconds, None)
    _print_tracks(tracks, common.console())
    common.say_files(figure=figure, film=film)
    if not tracks.certified:
        stop(1, "The tracks are not certified: see the remarks.")


def _level(
    star_theta: float | None, orbit: float | None, film: Path | None, source: SourceOptions
) -> tuple[str, float]:
    """The argument that places the source, and its value: theta', radians, on a sphere; r in the plane."""
    if source.plane is None:
        if orbit is not None:
            raise BadInput("Argument --orbit must be used with --plane.")
        if star_theta is None:
            raise BadInput("Argument --star-theta must be given.")
        return "star-theta", math.radians(star_theta)
    for name, value in (("--star-theta", star_theta), ("--film", film)):
        if value is not None:
            raise BadInput(f"Argument {name} must not be used with --plane.")
    if orbit is None:
        raise BadInput("Argument --orbit must be given with --plane.")
    return "orbit", orbit


def _caustics(tracks: "StarTracks") -> "CausticSet":
    from kerrcaustics.curves.caustic_search import caustics

    return caustics(tracks.camera, tracks.max_index + 1, end=tracks.surface)


def _check_orbit(camera: "Viewer") -> None:
    """Refuse a camera that stands still before any work is done."""
    try:
        camera.orbital_velocity()
    except ValueError:
        raise BadInput(
            f"Argument --velocity must make the camera orbit the spin axis, but this one does not: {place_of(camera)}."
        ) from None


def _print_tracks(tracks: "StarTracks", out: Console) -> None:
    place = place_in_words(tracks.surface, [tracks.level])
    say(out, f"{place_of(tracks.camera)}: tracks of a source at {place} on {tracks.surface.in_words()}")
    _print_curves(tracks, out)
    if tracks.events or tracks.ends:
        _print_events(tracks, out)
    say_all(out, tracks.remarks)
    total = f"{len(tracks.tracks)} tracks, {len(tracks.events) + len(tracks.ends)} events"
    if tracks.ends:
        say(out, f"Of {len(tracks.ends)} events one image has index {tracks.max_index + 1}, and no track here.")
    if not tracks.angular_velocity:
        phi = tracks.surface.coordinates[1].symbol
        say(out, f"{total} in one turn of {phi}: {verdict(tracks.certified)}; errors are those of {phi} in radians")
        return
    say(out, f"{total} in a period of {tracks.period:.9g}: {verdict(tracks.certified)};")
    say(out, "time 0 is when the star's phi' is that of the camera; errors are those of phi' in radians")


def _print_curves(tracks: "StarTracks", out: Console) -> None:
    table = PlainTable(("track", "index", "points", "turns in phi'", "events"))
    for i, track in enumerate(tracks.tracks, start=1):
        # At the ends of an open track the index is that of the images beyond.
        low, high = track.index.min(), min(track.index.max(), tracks.max_index)
        turns = str(track.turns) if track.closed else "open"
        index = f"{low} to {high}" if low < high else str(low)
        table.add_row(str(i), index, str(len(track)), turns, str(len(track.events)))
    out.print(table)


def _print_events(tracks: "StarTracks", out: Console) -> None:
    columns = {
        # Without an orbit there is no time.
        **({"time": "moment:z.9g"} if tracks.angular_velocity else {}),
        "event": "kind",
        "of index": lambda event: f"{event.indices[0]}, {event.indices[1]}",
        "phi' (deg)": "azimuth:z.8f",
        tracks.camera.sky_coordinates: "sky:+z.5f",
        "error": "error:.0e",
    }
    out.print(table_of((*tracks.events, *tracks.ends), columns))
