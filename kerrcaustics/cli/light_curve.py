"""The command `light-curve`: the light of a spot on a circular orbit."""

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rich.console import Console

from kerrcaustics.cli.app import app, stop, with_examples
from kerrcaustics.cli.options import COMMON, CameraOptions, CommonOptions, Crossings, FileName, Flag, WholeNumber
from kerrcaustics.cli.outputs import check_ending, check_film, write_figure
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import place_of, plain_errors, progress, say

if TYPE_CHECKING:
    from kerrcaustics.curves.light_curves import LightCurve


@app.command(**with_examples("light-curve --spin 0.9 --radius 100 --inclination 60 --orbit 6 --figure spot.png"))
def light_curve(
    *,
    camera: CameraOptions,
    orbit: float,
    size: float = 0.1,
    times: WholeNumber = 200,
    crossings: Crossings = 4,
    motion: Literal["circular", "retrograde"] = "circular",
    power: float = 4.0,
    figure: FileName | None = None,
    film: FileName | None = None,
    restart: Flag = False,
    save: FileName | None = None,
    common: CommonOptions = COMMON,
    points: Flag = False,
) -> None:
    """Follow the light of a small spot that circles the hole, image by image: flux, centroid, creations of images.

    The camera is static unless --velocity tells otherwise.

    Parameters
    ----------
    orbit
        Radius of the spot's circular orbit in the equatorial plane, in units of the mass.
    size
        Deviation of the spot's Gaussian profile along its orbit, in units of the mass.
    times
        So many times, evenly over one orbit.
    crossings
        How many crossings of the plane add to the light, 1 to 12.
    motion
        Which way the spot circles.
    power
        Intensity goes by the frequency ratio to this power: 4 for all light together.
    figure
        Draw the light curve and the images of the orbit into this file: .png, .pdf or .svg.
    film
        Write a film of one orbit into this file: .mp4 or .gif. Its curve is as fine as --times. An interrupted
        film resumes.
    restart
        Throw away frames of an unfinished film that are there, and draw all anew.
    save
        Save everything into this file, to be loaded with kerrcaustics.load.
    points
        Put flux, error, centroid and travel time at all times into the JSON too.
    """
    common.check({"--figure": figure, "--film": film, "--save": save})
    check_ending(figure)
    check_film(film)
    common.check_points(points)
    seen_from = replace(camera, velocity=camera.velocity or "static").camera()
    began = time.perf_counter()
    with plain_errors(), progress() as report:
        from kerrcaustics.curves.light_curves import light_curve as follow
        from kerrcaustics.results import storage
        from kerrcaustics.results.records import record

        found = follow(seen_from, orbit, times, size=size, crossings=crossings, motion=motion, power=power)
        seconds = time.perf_counter() - began
        if save is not None:
            storage.save(save, found)
        if figure is not None:
            report("drawing", 0.9)
            from kerrcaustics.draw.light_curves import light_curve_figure

            write_figure(light_curve_figure(found), figure)
    if film is not None:
        _write_film(found, motion, film, restart)
    common.write_found(record(found, camera=seen_from, points=points), seconds, None)
    _print(found, common.console())


def _write_film(found: "LightCurve", motion: str, path: Path, restart: bool) -> None:
    from kerrcaustics.cli.film import filmed
    from kerrcaustics.draw.light_curve_films import light_curve_film

    with progress(left=True) as report:
        made = filmed(path, light_curve_film(found, motion), report, restart=restart)
    if made.output is None:
        stop(1, made.complaint)


def _print(found: "LightCurve", out: Console) -> None:
    say(out, f"{place_of(found.camera)}: a spot on a circular orbit at r = {found.radius:g}, period {found.period:.9g}")
    table = PlainTable(("crossing", "of all light", "brightest", "at time"))
    whole = found.flux.mean()
    for crossing, share in enumerate(found.shares, start=1):
        best = int(share.argmax())
        table.add_row(str(crossing), f"{share.mean() / whole:.3%}", f"{share[best]:.6g}", f"{found.time[best]:z.6g}")
    out.print(table)
    for event in found.events:
        when = f"time {event.time:z.9g}, off by {event.error:.0e}"
        say(out, f"{event.kind} of two images at crossing {event.crossing}, {when}")
    low, high = found.flux.min(), found.flux.max()
    say(
        out,
        f"flux from {low:.6g} to {high:.6g} for a spot of unit light, off by {(found.error / found.flux).max():.0e}",
    )
