"""The command `tracks`: the images of a star over one orbit of the camera."""

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import cyclopts
from rich.console import Console

from kerrcaustics.cli.app import BadInput, app, stop
from kerrcaustics.cli.options import (
    JsonTarget,
    Velocity,
    WholeNumber,
    camera_at,
    check_ending,
    check_film,
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
    from kerrcaustics.stars.tracks import StarTracks

_WIDE = 112


@app.command
def tracks(
    *,
    spin: float,
    radius: float,
    star_theta: Annotated[float, cyclopts.Parameter(allow_leading_hyphen=True)],
    inclination: float = 90.0,
    velocity: Velocity = None,
    max_index: WholeNumber = 2,
    figure: Path | None = None,
    film: Path | None = None,
    json_: JsonTarget = None,
) -> None:
    """Follow all images of a star over one orbit of the camera, with the creation and annihilation of pairs.

    Parameters
    ----------
    spin
        Spin a of the hole, 0 <= a < 1.
    radius
        Boyer-Lindquist radius of the camera, in units of the mass.
    star_theta
        The star's angle theta' from the spin axis, degrees. Its phi' runs through a whole turn.
    inclination
        Angle of the camera from the spin axis, degrees: 90 is the equator.
    velocity
        Motion of the camera, which must orbit the spin axis: on a circular geodesic orbit, or with the fiducial
        observer. By default circular where there is such an orbit, else fiducial.
    max_index
        Highest Morse index, 0 to 6: how often a beam of light was focused to a line on its way.
    figure
        Draw the tracks, the events and the brightness into this file: .png, .pdf or .svg.
    film
        Write a film of the orbit into this file: .mp4 or .gif. It takes minutes; started again after an interruption,
        it goes on where it stopped.
    json_
        Write the numbers to this file as JSON; - is standard output.
    """
    if not 0 <= star_theta <= 180:
        raise BadInput(f"Argument --star-theta must lie in [0, 180] degrees, but is {star_theta:g}.")
    check_outputs({"--figure": figure, "--film": film, "--json": json_file(json_)})
    check_ending(figure)
    check_film(film)
    camera = camera_at(spin, radius, inclination, velocity)
    _check_orbit(camera)
    began = time.perf_counter()
    with plain_errors(), progress() as report:
        from kerrcaustics.stars.tracks import star_tracks

        found = star_tracks(camera, math.radians(star_theta), max_index)
        seconds = time.perf_counter() - began
        if figure is not None:
            report("drawing", 0.9)
            from kerrcaustics.curves.caustic import caustics
            from kerrcaustics.draw.tracks import tracks_figure

            write_figure(tracks_figure(found, caustics(camera, max_index + 1)), figure)
    if film is not None:
        _write_film(found, film)
    if json_ is not None:
        from kerrcaustics.results.records import record

        write_found(record(found), json_, seconds, None)
    _print_tracks(camera, found, console(stderr=json_ == "-", width=_WIDE))
    if not found.certified:
        stop(1, "The tracks are not certified: see the remarks.")


def _write_film(found: "StarTracks", path: Path) -> None:
    from kerrcaustics.curves.caustic import caustics
    from kerrcaustics.draw.films import write_film
    from kerrcaustics.draw.orbit import orbit_film

    with progress(left=True) as report:
        write_film(path, orbit_film(found, caustics(found.camera, found.max_index + 1)), report)


def _check_orbit(camera: "Camera") -> None:
    """Refuse a camera that stands still, before any work is done."""
    from kerrcaustics.stars.events import orbital_velocity

    try:
        orbital_velocity(camera)
    except ValueError:
        raise BadInput(
            f"Argument --velocity must make the camera orbit the spin axis, but this one does not: {place_of(camera)}."
        ) from None


def _print_tracks(camera: "Camera", found: "StarTracks", out: Console) -> None:
    say(out, f"{place_of(camera)}: tracks of a star at theta' = {math.degrees(found.theta):.12g} deg")
    curves = plain_table(("track", "index", "points", "turns in phi'", "events"))
    for i, track in enumerate(found.tracks, start=1):
        # At the ends of an open track the index is that of the images beyond.
        low, high = track.index.min(), min(track.index.max(), found.max_index)
        turns = str(track.turns) if track.closed else "open"
        curves.add_row(
            str(i), f"{low} to {high}" if low < high else str(low), str(len(track)), turns, str(len(track.events))
        )
    out.print(curves)
    table = plain_table(("time", "event", "of index", "phi' (deg)", "direction N", "error"))
    for event in found.events:
        table.add_row(
            f"{event.time:.9g}",
            event.kind,
            f"{event.indices[0]}, {event.indices[1]}",
            f"{math.degrees(event.azimuth):.8f}",
            " ".join(f"{x:+.5f}" for x in event.sky),
            f"{event.error:.0e}",
        )
    if found.events:
        out.print(table)
    for remark in found.remarks:
        say(out, remark)
    sure = "certified" if found.certified else "NOT certified"
    say(out, f"{len(found.tracks)} tracks, {len(found.events)} events in a period of {found.period:.9g}: {sure};")
    say(out, "time 0 is when the star's phi' is that of the camera; errors are those of phi' in radians")
