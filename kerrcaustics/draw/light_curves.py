"""Light curves of spots: their flux, crossing by crossing, and where on the camera sky it comes from."""

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.draw import style
from kerrcaustics.draw.projection import about_hole, whole_line
from kerrcaustics.draw.sky_axes import name_sky_axes
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.isoradials import isoradials

if TYPE_CHECKING:
    from kerrcaustics.tracks.light_curves import LightCurve

Array = np.ndarray

# Light fainter than this part of the brightest is not shown.
_FAINTEST = 3e-5
_POINTS = 1440
_NUMERALS = ("first", "second", "third", "fourth", "fifth", "sixth")


def light_curve_figure(light: "LightCurve") -> Figure:
    """Flux against time; below, where the orbit is seen, where images are born and die, and the centroid's way."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.6), layout="constrained")
        upper, lower = figure.subplots(2, 1, height_ratios=[1, 1.1])
        show_flux(upper, light)
        show_orbit(lower, light)
        camera = light.camera
        place = f"spin {camera.spin:g}, radius {camera.radius:g}, inclination {math.degrees(camera.inclination):g} deg"
        figure.suptitle(f"spot at r = {light.radius:g} M; {place}")
    return figure


def show_flux(ax: Axes, light: "LightCurve") -> None:
    """The flux, what each crossing adds to it, and when images are created (dashed) and destroyed (dotted)."""
    order = np.argsort(light.time)
    time = light.time[order]
    ax.semilogy(time, light.flux[order], color="black", label="all")
    for crossing, share in enumerate(light.shares, start=1):
        positive = np.maximum(share[order], 1e-300)
        ax.semilogy(time, positive, color=crossing_colour(crossing), lw=1, label=f"{_name(crossing)} crossing")
    for event in light.events:
        line = "--" if event.kind == "creation" else ":"
        ax.axvline(event.moment, color=crossing_colour(event.crossing), ls=line, lw=0.8)
    ax.set_xlim(time[0], time[-1])
    ax.set_ylim(_FAINTEST * light.flux.max(), 2 * light.flux.max())
    ax.set_xlabel("time of the camera (M)")
    ax.set_ylabel(f"flux of a unit spot ({sky_area(light.camera)})")
    ax.legend(ncols=2, loc="lower center", fontsize="small")


def show_orbit(ax: Axes, light: "LightCurve") -> None:
    """The images of the orbit about the shadow; creations (circles), annihilations (crosses), the centroid (grey)."""
    crossings = len(light.shares)
    edge = shadow_edge(light.camera, 400)
    ax.fill(*about_hole(edge).T, color="0.85")
    for curve in isoradials(light.camera, [light.radius], crossings, _POINTS):
        ax.plot(*about_hole(whole_line(curve.sky, True)).T, color=crossing_colour(curve.crossing), lw=1)
    ax.plot(*about_hole(light.centroid).T, color="0.4", lw=0.8, ls=(0, (4, 2)))
    for event in light.events:
        marker = "o" if event.kind == "creation" else "x"
        ax.plot(*about_hole(event.sky), marker, color=crossing_colour(event.crossing), ms=5)
    name_sky_axes(ax, edge)


def sky_area(viewer: Viewer) -> str:
    """The unit of solid angles on the sky of a viewer."""
    return "sr" if viewer.sky_unit == "rad" else "M²"


def crossing_colour(crossing: int) -> str:
    """The colour of all that belongs to a crossing."""
    return f"C{crossing - 1}"


def _name(crossing: int) -> str:
    return _NUMERALS[crossing - 1] if crossing <= len(_NUMERALS) else f"{crossing}th"
