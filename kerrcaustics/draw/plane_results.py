"""Plots of results in the equatorial plane, and in space, seen along the spin axis."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Circle

from kerrcaustics.beams.paths import SpacePoints
from kerrcaustics.curves.caustic import Caustic
from kerrcaustics.curves.tubes import CausticTube
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import whole_line
from kerrcaustics.spacetime import kerr
from kerrcaustics.stars.counts import CountMap, ImageCounts
from kerrcaustics.stars.events import PairEvent

Array = np.ndarray

# Beyond this radius (GM/c^2) a picture ends.
_REACH = 20.0


def plane_counts(ax: Axes, counts: ImageCounts) -> Axes:
    """The sources in the equatorial plane, coloured by how many images each has."""
    x, y = _in_plane(counts.stars)
    drawn = numbered(ax, x, y, counts.counts.sum(axis=1))
    drawn.colorbar(ax.collections[-1], ax=ax, label="images")
    return _plane_axes(ax)


def plane_count_map(ax: Axes, counts: CountMap) -> Axes:
    """The sources of the map in the equatorial plane, coloured by how many images each has."""
    r, phi = np.meshgrid(counts.level, counts.phi, indexing="ij")
    x, y = _in_plane(np.stack([r.ravel(), phi.ravel()], axis=-1))
    drawn = numbered(ax, x, y, counts.counts.sum(axis=2).ravel())
    drawn.colorbar(ax.collections[-1], ax=ax, label="images")
    return _plane_axes(ax)


def plane_events(ax: Axes, events: Iterable[PairEvent]) -> Axes:
    """Where the source is when its images are created (up) or annihilated (down), one colour an order."""
    for event in events:
        x, y = _in_plane(np.array([event.star]))
        mark: dict[str, Any] = {
            "marker": style.EVENTS.get(event.kind, "o"),
            "color": style.order_colour(event.order),
        }
        ax.plot(x, y, linestyle="none", **mark)
    return _plane_axes(ax)


def plane_caustic(ax: Axes, caustic: Caustic) -> Axes:
    """The curve seen along the spin axis, as far as 20 M."""
    return plane_caustic_set(ax, [caustic])


def plane_caustic_set(ax: Axes, caustics: Iterable[Caustic]) -> Axes:
    """The curves seen along the spin axis, as far as 20 M."""
    for caustic in caustics:
        near = np.where(caustic.place[:, :1] < _REACH, caustic.place, np.nan)
        ax.plot(*_in_plane(whole_line(near, caustic.closed)), **style.order_line(caustic.order))
    return _plane_axes(ax)


def space_points(ax: Axes, points: SpacePoints) -> Axes:
    """The paths seen along the spin axis, as far as 20 M, and the hole."""
    ax.add_patch(Circle((0, 0), math.hypot(kerr.horizon(points.spin), points.spin), color="black"))
    size = points.radius.shape[-1] if points.radius.ndim else 1
    radius = np.where(points.radius < _REACH, points.radius, np.nan).reshape(-1, size)
    theta, phi = (values.reshape(-1, size) for values in (points.theta, points.azimuth))
    across = np.hypot(radius, points.spin) * np.sin(theta)
    ax.plot((across * np.cos(phi)).T, (across * np.sin(phi)).T, linewidth=0.8)
    return _plane_axes(ax)


def tube_rows(ax: Axes, tube: CausticTube) -> Axes:
    """Its rows seen along the spin axis, as far as 20 M."""
    return space_points(ax, tube.points)


def _in_plane(places: Float[Array, "n 2"]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """x and y of radii and azimuths."""
    return places[:, 0] * np.cos(places[:, 1]), places[:, 0] * np.sin(places[:, 1])


def _plane_axes(ax: Axes) -> Axes:
    ax.set(xlabel="x (GM/c²)", ylabel="y (GM/c²)")
    ax.set_aspect("equal", adjustable="box")
    return ax


def numbered(ax: Axes, x: Float[Array, " n"], y: Float[Array, " n"], total: Array) -> Any:
    """Points coloured by whole numbers; returns the figure."""
    colours = ListedColormap(colormaps["viridis"](np.linspace(0.05, 0.95, 16)))
    ax.scatter(x, y, c=total, s=12, cmap=colours)
    return ax.figure
