"""Axes of the camera sky and of the celestial sphere in degrees; lines of critical curves and caustics on them."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from kerrcaustics.curves.caustic import Caustic
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import OVERLAP, azimuthal_equidistant, smoothed, whole_line

Array = np.ndarray

# From the borders of the picture, degrees.
_AWAY = 1e-9


def camera_sky_axes(ax: Axes, step: float) -> Axes:
    """Name the axes of an azimuthal equidistant picture of the camera sky; a tick every `step` degrees."""
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MultipleLocator(step))
    ax.set_xlabel("to the right (deg, azimuthal equidistant)")
    ax.set_ylabel("up, along the spin axis (deg)")
    return ax


def name_sky_axes(ax: Axes, sky: Float[Array, "n k"]) -> None:
    """Name the axes of what lies about the hole, in degrees to the right and up; of an Observer alpha and beta."""
    distant = sky.shape[-1] == 2
    ax.set_xlabel("α (GM/c²)" if distant else "to the right (deg)")
    ax.set_ylabel("β (GM/c²)" if distant else "up (deg)")
    ax.set_aspect("equal", adjustable="box")


def unrolled_axes(ax: Axes) -> Axes:
    """Name the axes of an unrolled picture of the camera sky, position angle against distance to the shadow edge."""
    ax.set_xlim(-OVERLAP, 360 + OVERLAP)
    ax.xaxis.set_major_locator(MultipleLocator(90))
    ax.set_xlabel("position angle (deg; 0 right, 90 up, 180 left)")
    ax.set_ylabel("distance to shadow edge (deg)")
    return ax


def celestial_sphere_axes(ax: Axes, name: str = "φ′ (deg)", step: float = 30) -> Axes:
    """Axes of the whole celestial sphere: phi' (`name`) from -180 to 180, theta' down, a tick every `step` degrees."""
    ax.set(xlim=(-180, 180), ylim=(180, 0), xlabel=name, ylabel="θ′ (deg)")
    ax.xaxis.set_major_locator(MultipleLocator(60))
    ax.yaxis.set_major_locator(MultipleLocator(step))
    return ax


def critical_line(caustic: Caustic, axes: Float[Array, "3 3"]) -> Float[Array, "n 2"]:
    """Critical curve in degrees on the picture of `view_axes`, ready to be drawn: closed where it is."""
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
