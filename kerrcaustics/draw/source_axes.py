"""Axes of the surfaces on which sources lie: a sphere by phi' and theta', the equatorial plane from above."""

import math
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from kerrcaustics.beams.ends import End
from kerrcaustics.curves.caustic import Caustic
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import whole_line
from kerrcaustics.draw.sky_axes import celestial_sphere_axes

Array = np.ndarray

REACH = 20.0
"""Radius (GM/c^2) at which curves in pictures from above end."""


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
    ax.set(xlabel="x (GM/c²)", ylabel="y (GM/c²)")
    ax.set_aspect("equal", adjustable="box")
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
