"""The command `light-curve`: the light of a spot on a circular orbit, or of a source on any orbit."""

import math
import os
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from rich.console import Console

from kerrcaustics.choices import SpotMotion, number_suggestion
from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.film import write_film
from kerrcaustics.cli.options import (
    COMMON,
    UNITS_OF_MASS,
    Angles,
    CameraOptions,
    CommonOptions,
    Crossings,
    FileName,
    Flag,
    MaxIndex,
    ScaleOptions,
    WholeNumber,
)
from kerrcaustics.cli.outputs import check_ending, check_film, check_table, write_figure, write_table
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import place_of, plain_errors, progress, say, say_all, verdict

if TYPE_CHECKING:
    from kerrcaustics.interop.physical_scale import PhysicalScale
    from kerrcaustics.light_curves.results import LightCurve
    from kerrcaustics.orbits.orbit import Orbit
    from kerrcaustics.spacetime.viewer import Viewer


@app.command(
    **with_examples(
        "light-curve --spin 0.9 --radius 100 --inclination 60 --orbit 6 --figure spot.png",
        "light-curve --spin 0.9 --radius inf --inclination 60 --orbit 8 --source point --table light.csv",
        "light-curve --spin 0.9 --radius inf --orbit 8 --mass 4.3e6 --distance 8180 --figure flare.png",
        "light-curve --spin 0.9 --radius 50 --orbit fall.toml --during 50 150 --table light.fits",
    )
)
def light_curve(
    *,
    camera: CameraOptions,
    orbit: str,
    source: Literal["point", "ball", "spot"] | None = None,
    during: Angles | None = None,
    times: WholeNumber = 200,
    max_index: MaxIndex | None = None,
    size: float | None = None,
    crossings: Crossings | None = None,
    motion: SpotMotion | None = None,
    power: float | None = None,
    figure: FileName | None = None,
    film: FileName | None = None,
    restart: Flag = False,
    table: FileName | None = None,
    save: FileName | None = None,
    scaling: ScaleOptions = UNITS_OF_MASS,
    common: CommonOptions = COMMON,
    points: Flag = False,
) -> None:
    """Follow the light of a source on an orbit, image by image: flux, centroid, creation of images.

    The camera is static unless --velocity is given; with --radius inf it is an observer at infinity.

    Parameters
    ----------
    orbit
        Radius of a circular orbit in the equatorial plane, in units of the mass, or a TOML file: kind = "geodesic"
        with radius, theta, phi, velocity and time, or kind = "kepler" with semi_major_axis, eccentricity, inclination,
        node, pericentre and time; angles in degrees.
    source
        point: a star of luminosity 1 that shines equally in all directions. ball: the same, of the given --size. spot:
        a Gaussian spot in a disk, on a circular orbit. By default a spot if --orbit is a radius, else a point.
    during
        First and last time of the camera, in units of the mass, or with --mass in the unit of the figure, such as
        minutes; by default one period of the orbit.
    times
        Number of times, evenly spaced over this interval.
    max_index
        Highest Morse index of the images of a point or a ball, 0 to 6; 2 by default.
    size
        Radius of a ball, or standard deviation of a spot's Gaussian profile along its orbit, in units of the mass; 0.1
        by default.
    crossings
        For a spot: number of crossings of the plane that contribute to the light, 1 to 12; 4 by default.
    motion
        For a spot: direction of its orbital motion; circular by default.
    power
        For a spot: the intensity scales as the frequency ratio to this power: by default 4, for the light of all
        frequencies.
    figure
        Save a plot of the light curve and the images to this file: .png, .pdf or .svg.
    film
        Write a film of one orbit of a spot to this file: .mp4 or .gif. The light curve in it has as many points as
        --times says. An interrupted film resumes when the command is run again.
    restart
        Discard the existing frames of an unfinished film and draw all of them again.
    table
        Write all quantities as functions of time to this file: .csv or .fits. With --mass, times are in the unit of the
        figure, and with --distance places on the sky in microarcseconds: names of columns end in the unit (time_min).
    save
        Save everything to this file, which kerrcaustics.load reads, in units of the mass, as in the JSON.
    points
        Include flux, error, centroid and all other functions of time in the JSON.
    """
    common.check({"--figure": figure, "--film": film, "--table": table, "--save": save})
    check_ending(figure)
    check_film(film, restart=restart)
    check_table(table)
    common.check_points(points)
    if during is not None and not -math.inf < during[0] < during[1] < math.inf:
        raise BadInput(
            f"Argument --during must be two finite times, the earlier first, but is {during[0]:g} {during[1]:g}."
        )
    units, way = scaling.scale(camera), _orbit(orbit)
    if during is None and getattr(way, "period", orbit) is None:
        raise BadInput("Argument --during must be given, as this orbit has no period.")
    kind: Any = source or ("spot" if isinstance(way, float) else "point")
    if film is not None and kind != "spot":
        raise BadInput("Argument --film must be used with a spot.")
    viewer = _viewer(camera, isinstance(way, float), kind == "spot")
    began = time.perf_counter()
    with plain_errors(), progress() as report:
        from kerrcaustics.light_curves.light_curve import light_curve as follow
        from kerrcaustics.results import storage
        from kerrcaustics.results.records import record

        each = 1.0 if units is None else units.time_unit[1]
        clock: Any = times if during is None else np.linspace(*during, times) / each
        shining = _shining(kind, {"size": size, "crossings": crossings, "motion": motion, "power": power})
        light: Any = follow(viewer, way, clock, source=shining, max_index=max_index, progress=report)
        seconds = time.perf_counter() - began
        if save is not None:
            storage.save(save, light)
        if table is not None:
            write_table(light, table, scale=units)
        if figure is not None:
            report("drawing", 1.0)
            from kerrcaustics.draw.light_curves import light_curve_figure

            write_figure(light_curve_figure(light, units), figure)
    if film is not None:
        from kerrcaustics.draw.spot_films import light_curve_film

        write_film(film, lambda: light_curve_film(light, scale=units), restart)
    common.write_result(record(light, camera=viewer, points=points), seconds, None)
    _print(light, common.console(), units)
    common.say_files(figure=figure, film=film, table=table, saved=save)
    if not light.certified:
        stop(1, "Not all images are certified: see the remarks.")


def _viewer(camera: CameraOptions, circle: bool, spot: bool) -> "Viewer":
    """The camera, static by default; circle: the source circles in the equatorial plane."""
    # Observers have no velocity to choose.
    if not (camera.is_observer or camera.velocity is not None):
        camera = replace(camera, velocity="static")
    return (camera.off_equator() if circle else camera).viewer(spot)


def _shining(kind: str, given: dict[str, Any]) -> Any:
    """A kind of source with its properties; BadInput for a property that it has not."""
    from kerrcaustics.light_curves.sources import Ball, Spot

    record: Any = {"ball": Ball, "spot": Spot}.get(kind)
    chosen = {name: value for name, value in given.items() if value is not None}
    for name in chosen:
        if record is None or name not in record.__dataclass_fields__:
            users = "a ball or a spot" if name == "size" else "a spot"
            raise BadInput(f"Argument --{name} must be left out for a {kind}, as only {users} has it.")
    return kind if record is None else record(**chosen)


def _orbit(text: str) -> "float | Orbit":
    """The radius of a circle, or the orbit in a file."""
    try:
        return float(text)
    except ValueError:
        from kerrcaustics.scene_files.orbit_file import read_orbit
    if (end := number_suggestion(text)) != "." and not os.path.exists(text):
        raise BadInput(f"Argument --orbit must be a radius or name a TOML file, but is {text}{end}")
    try:
        return read_orbit(text)
    except ValueError as error:
        raise BadInput(str(error).replace("Argument ORBIT", "Argument --orbit")) from None


def _print(light: "LightCurve", out: Console, scale: "PhysicalScale | None") -> None:
    """The light of each image, the events, and the flux with its error."""
    from kerrcaustics.light_curves.results import SpotEvent

    unit, each = scale.time_unit if scale else ("", 1.0)
    # After a number, and after a head.
    after, head = (f" {unit}", f" ({unit})") if unit else ("", "")
    period = "" if math.isnan(light.period) else f", period {light.period * each:.9g}{after}"
    say(out, f"{place_of(light.camera)}: a {light.source} on the orbit {light.orbit}{period}")
    of_spot = light.source == "spot"
    names = light.crossing if of_spot else light.index
    table = PlainTable(
        (
            "crossing" if of_spot else "index",
            "of all light",
            "largest sample",
            f"at time{head}",
            f"from{head}",
            f"to{head}",
        )
    )
    for name, share, emitted in zip(names.tolist(), light.shares, light.emission_time, strict=True):
        seen = light.time[np.isfinite(emitted)] * each
        best = int(np.nanargmax(share)) if np.isfinite(share).any() else 0
        ends = (f"{seen.min():z.6g}", f"{seen.max():z.6g}") if len(seen) else ("", "")
        part = np.nansum(share) / np.nansum(light.flux)
        table.add_row(str(name), f"{part:.3%}", f"{share[best]:.6g}", f"{light.time[best] * each:z.6g}", *ends)
    out.print(table)
    for event in light.events:
        place = f"crossing {event.crossing}" if isinstance(event, SpotEvent) else f"a caustic of order {event.order}"
        when = f"time {event.moment * each:z.9g}{after}, error {event.error * each:.0e}"
        say(out, f"{event.kind} of two images at {place}, {when}")
    say_all(out, light.remarks)
    low, high = np.nanmin(light.flux), np.nanmax(light.flux)
    error = f"{np.nanmax(light.error / light.flux):.0e}"
    area = "sr " if light.camera.sky_unit == "rad" else "M^2 "
    light_of = f"{area}for a spot of unit light" if of_spot else "for luminosity 1"
    flux = f"flux of these images from {low:.6g} to {high:.6g} {light_of}, relative error at most {error}"
    say(out, f"{flux}: {verdict(light.certified)}")
