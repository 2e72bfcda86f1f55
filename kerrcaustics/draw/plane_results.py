"""Plots of results in the equatorial plane, seen along the spin axis."""

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes

from kerrcaustics.curves.plane_caustics import PlaneCaustic
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import whole_line
from kerrcaustics.draw.source_axes import REACH, from_above, in_plane


def plane_caustic(ax: Axes, caustic: PlaneCaustic) -> Axes:
    """The curve seen along the spin axis, as far as 20 M."""
    return plane_caustic_set(ax, [caustic])


def plane_caustic_set(ax: Axes, caustics: Iterable[PlaneCaustic]) -> Axes:
    """The curves seen along the spin axis, as far as 20 M."""
    for caustic in caustics:
        near = np.where(caustic.place[:, :1] < REACH, caustic.place, np.nan)
        ax.plot(*in_plane(whole_line(near, caustic.closed)), **style.order_line(caustic.order))
    return from_above(ax)
