"""Axes of the camera sky, in degrees, and of the surfaces on which sources lie; critical curves and caustics on them.

Surfaces are a sphere, by phi' and theta', and the equatorial plane, from above.
"""

import math
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.ticker import MultipleLocator

from kerrcaustics.beams.ends import End
from kerrcaustics.curves.caustic import Caustic
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import OVERLAP, azimuthal_equidistant, smoothed, whole_line

Array = np.ndarray

REACH = 20.0
"""Radius (GM/c^2) at which curves in pictures from above end."""

# From the borders of the picture, degrees.
_AWAY = 1e-9


def camera_sky_axes(ax: Axes, step: float, unit: str = "rad") -> Axes:
    """Name the axes of a picture of the camera sky, of which `unit` is the `sky_unit`; a tick every `step`.

    In degrees the picture is azimuthal equidistant.
    """
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MultipleLocator(step))
    flat = unit != "rad"
    ax.set_xlabel("α (M)" if flat else "to the right (deg, azimuthal equidistant)")
    ax.set_ylabel("β (M), along the spin axis" if flat else "up, along the spin axis (deg)")
    return ax


def name_sky_axes(ax: Axes, sky: Float[Array, "n axes"]) -> None:
    """Name the axes of what lies about the hole, in degrees to the right and up; of an Observer alpha and beta."""
    distant = sky.shape[-1] == 2
    right, up = ("α (GM/c²)", "β (GM/c²)") if distant else ("to the right (deg)", "up (deg)")
    ax.set(xlabel=right, ylabel=up, aspect="equal")


def unrolled_axes(ax: Axes, unit: str = "rad") -> Axes:
    """Name the axes of an unrolled picture of the camera sky, position angle against distance to the shadow edge."""
    ax.set(xlim=(-OVERLAP, 360 + OVERLAP), ylabel=f"distance to shadow edge ({'deg' if unit == 'rad' else 'M'})")
    ax.set_xlabel("position angle (deg; 0 right, 90 up, 180 left)")
    ax.xaxis.set_major_locator(MultipleLocator(90))
    return ax


def celestial_sphere_axes(ax: Axes, name: str = "φ′ (deg)", step: float = 30) -> Axes:
    """Axes of the whole celestial sphere: phi' (`name`) from -180 to 180, theta' down, a tick every `step` degrees."""
    ax.set(xlim=(-180, 180), ylim=(180, 0), xlabel=name, ylabel="θ′ (deg)")
    ax.xaxis.set_major_locator(MultipleLocator(60))
    ax.yaxis.set_major_locator(MultipleLocator(step))
    return ax


def critical_line(caustic: Caustic, axes: Float[Array, "..."]) -> Float[Array, "n 2"]:
    """Critical curve, in degrees or M, on the picture of `view_axes`, ready to be drawn: closed where it is."""
    return azimuthal_equidistant(whole_line(smoothed(caustic.sky), True) if caustic.closed else caustic.sky, axes)


def draw_wrapped(ax: Axes, caustic: Caustic, width: float, narrow: float, **settings: Any) -> None:
    """A caustic on axes of the whole celestial sphere, a cross where it is a point.

    width, narrow: of its line, where it goes round less than twice, and else; settings: of the line besides.
    """
    if caustic.kind == "point":
        style.draw_cross(ax, wrapped(np.degrees(caustic.celestial[:1]))[0], caustic.order)
        return
    line = wrapped(np.degrees(whole_line(caustic.celestial, caustic.closed)))
    linewidth = width if caustic.circuits < 2 else narrow
    ax.plot(*line.T, linewidth=linewidth, **style.order_line(caustic.order), **settings)


def wrapped(celestial: Float[Array, "n 2"]) -> Float[Array, "m 2"]:
    """Line of phi' in [-180, 180] and theta', degrees, of a curve of theta' and unwrapped phi'.

    A line that leaves the picture on one side is led to the border, broken, and begun again on the other.
    """
    pieces = []
    # A point on the border itself belongs to the side of larger phi'.
    on_border = (celestial[:, 1] + 180) % 360 == 0
    celestial = np.stack([celestial[:, 0], celestial[:, 1] + np.where(on_border, _AWAY, 0.0)], axis=-1)
    for start, end in pairwise(celestial):
        pieces += [start, *_crossings(start, end)]
    pieces.append(celestial[-1])
    theta, phi = np.array(pieces).T
    return np.stack([(phi + 180) % 360 - 180, theta], axis=-1)


def _crossings(start: Float[Array, "2"], end: Float[Array, "2"]) -> list[tuple[float, float]]:
    """Places (theta', phi') where a step leaves the picture, a gap, and where it comes in again, in this order."""
    places = []
    low, high = sorted((start[1], end[1]))
    for border in range(math.ceil((low + 180) / 360), math.floor((high + 180) / 360) + 1):
        phi = 360.0 * border - 180
        part = (phi - start[1]) / (end[1] - start[1]) if end[1] != start[1] else 0.0
        theta = start[0] + part * (end[0] - start[0])
        side = 1 if end[1] > start[1] else -1
        places += [(theta, phi - side * _AWAY), (math.nan, math.nan), (theta, phi + side * _AWAY)]
    return places


def draw_places(ax: Axes, surface: End, places: Float[Array, "n 2"], **settings: Any) -> Axes:
    """Draw places on a surface as points on its axes."""
    ax.plot(*on_axes(surface, places), **{"linestyle": "none", "color": "black", **settings})
    return source_axes(ax, surface)


def draw_totals(ax: Axes, surface: End, places: Float[Array, "n 2"], total: Int[Array, " n"]) -> Axes:
    """Draw places on a surface, coloured by how many images each has."""
    colours = ListedColormap(colormaps["viridis"](np.linspace(0.05, 0.95, 16)))
    points = ax.scatter(*on_axes(surface, places), c=total, s=12, cmap=colours)
    ax.figure.colorbar(points, ax=ax, label="images")
    return source_axes(ax, surface)


def source_axes(ax: Axes, surface: End) -> Axes:
    """Name the axes of a picture of a surface."""
    return celestial_sphere_axes(ax) if is_sphere(surface) else from_above(ax)


def from_above(ax: Axes) -> Axes:
    """Name the axes of a picture seen along the spin axis, y upward."""
    ax.set(xlabel="x (GM/c²)", ylabel="y (GM/c²)", aspect="equal")
    return ax


def in_plane(places: Float[Array, "n 2"]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """x and y of radii and azimuths."""
    return places[:, 0] * np.cos(places[:, 1]), places[:, 0] * np.sin(places[:, 1])


def draw_from_above(ax: Axes, caustic: Caustic, **settings: Any) -> None:
    """Draw a caustic in the plane as far as 20 M."""
    near = np.where(caustic.place[:, :1] < REACH, caustic.place, np.nan)
    ax.plot(*in_plane(whole_line(near, caustic.closed)), **style.order_line(caustic.order), **settings)


def level_in_words(surface: End, level: float) -> str:
    """The first coordinate of a place on a surface: "θ′ = 80 deg", "r = 6"."""
    return f"θ′ = {math.degrees(level):.12g} deg" if is_sphere(surface) else f"r = {level:.12g}"


def on_axes(surface: End, places: Float[Array, "n 2"]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """x and y of places on the axes of a surface; phi' in [-180, 180) degrees."""
    if not is_sphere(surface):
        return in_plane(places)
    return np.degrees((places[:, 1] + math.pi) % (2 * math.pi) - math.pi), np.degrees(places[:, 0])


def is_sphere(surface: End) -> bool:
    """True if the coordinates of a surface are two angles."""
    return surface.coordinates[0].unit == "rad"
