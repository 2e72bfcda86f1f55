"""Plots of results in space, seen along the spin axis."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from kerrcaustics.beams.paths import SpacePoints
from kerrcaustics.curves.tubes import CausticTube
from kerrcaustics.draw.source_axes import REACH, from_above
from kerrcaustics.spacetime import kerr


def space_points(ax: Axes, points: SpacePoints) -> Axes:
    """The paths as far as 20 M, and the hole."""
    ax.add_patch(Circle((0, 0), math.hypot(kerr.horizon(points.spin), points.spin), color="black"))
    size = points.radius.shape[-1] if points.radius.ndim else 1
    radius = np.where(points.radius < REACH, points.radius, np.nan).reshape(-1, size)
    theta, phi = (values.reshape(-1, size) for values in (points.theta, points.azimuth))
    across = np.hypot(radius, points.spin) * np.sin(theta)
    ax.plot((across * np.cos(phi)).T, (across * np.sin(phi)).T, linewidth=0.8)
    return from_above(ax)


def tube_rows(ax: Axes, tube: CausticTube) -> Axes:
    """The rows of the tube as far as 20 M."""
    return space_points(ax, tube.points)
