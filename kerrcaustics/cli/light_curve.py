"""The command `light-curve`: the light of a spot on a circular orbit."""

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from rich.console import Console

from kerrcaustics.choices import SpotMotion
from kerrcaustics.cli.app import app, stop, with_examples
from kerrcaustics.cli.film import write_film
from kerrcaustics.cli.options import COMMON, CameraOptions, CommonOptions, Crossings, FileName, Flag, WholeNumber
from kerrcaustics.cli.outputs import check_ending, check_film, write_figure
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import place_of, plain_errors, progress, say, say_all

if TYPE_CHECKING:
    from kerrcaustics.tracks.light_curves import LightCurve


@app.command(**with_examples("light-curve --spin 0.9 --radius 100 --inclination 60 --orbit 6 --figure spot.png"))
def light_curve(
    *,
    camera: CameraOptions,
    orbit: float,
    size: float = 0.1,
    times: WholeNumber = 200,
    crossings: Crossings = 4,
    motion: SpotMotion = "circular",
    power: float = 4.0,
    figure: FileName | None = None,
    film: FileName | None = None,
    restart: Flag = False,
    save: FileName | None = None,
    common: CommonOptions = COMMON,
    points: Flag = False,
) -> None:
    """Follow the light of a small spot that circles the hole, image by image: flux, centroid, creations of images.

    The camera is static unless --velocity is given; with --radius inf it is an observer at infinity.

    Parameters
    ----------
    orbit
        Radius of the spot's circular orbit in the equatorial plane, in units of the mass.
    size
        Deviation of the spot's Gaussian profile along its orbit, in units of the mass.
    times
        Number of times, evenly over one orbit.
    crossings
        Number of crossings of the plane that add to the light, 1 to 12.
    motion
        Sense in which the spot circles.
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
    # At infinity nothing is static but the fiducial observer.
    still = camera if camera.radius == math.inf else replace(camera, velocity=camera.velocity or "static")
    seen_from = still.viewer()
    began = time.perf_counter()
    with plain_errors({"camera": "inclination"}), progress() as report:
        from kerrcaustics.moving_sources.light_curve import light_curve as follow
        from kerrcaustics.results import storage
        from kerrcaustics.results.records import record

        spot = {"size": size, "crossings": crossings, "motion": motion, "power": power}
        light = follow(seen_from, orbit, times, **spot, progress=report)
        seconds = time.perf_counter() - began
        if save is not None:
            storage.save(save, light)
        if figure is not None:
            report("drawing", 1.0)
            from kerrcaustics.draw.light_curves import light_curve_figure

            write_figure(light_curve_figure(light), figure)
    if film is not None:
        from kerrcaustics.draw.light_curves import light_curve_film

        write_film(film, lambda: light_curve_film(light, motion), restart)
    common.write_result(record(light, camera=seen_from, points=points), seconds, None)
    _print(light, common.console())
    common.say_files(figure=figure, film=film, saved=save)
    if not light.certified:
        stop(1, "Not all images are certified: see the remarks.")


def _print(light: "LightCurve", out: Console) -> None:
    say(out, f"{place_of(light.camera)}: a spot on a circular orbit at r = {light.radius:g}, period {light.period:.9g}")
    table = PlainTable(("crossing", "of all light", "brightest", "at time"))
    whole = light.flux.mean()
    for crossing, share in enumerate(light.shares, start=1):
        best = int(share.argmax())
        table.add_row(str(crossing), f"{share.mean() / whole:.3%}", f"{share[best]:.6g}", f"{light.time[best]:z.6g}")
    out.print(table)
    for event in light.events:
        moment = f"time {event.moment:z.9g}, off by {event.error:.0e}"
        say(out, f"{event.kind} of two images at crossing {event.crossing}, {moment}")
    say_all(out, light.remarks)
    low, high = light.flux.min(), light.flux.max()
    error = f"{(light.error / light.flux).max():.0e}"
    unit = "sr" if light.camera.sky_unit == "rad" else "M^2"
    say(out, f"flux from {low:.6g} to {high:.6g} {unit} for a spot of unit light, off by {error}")
