"""Plots of results in space: paths, their beams, and rows of tubes."""

import math
from typing import get_args

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Annulus, Ellipse

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.path_beams import PathBeams
from kerrcaustics.beams.paths import RayPaths, SpacePoints, cartesian
from kerrcaustics.choices import PlaneName
from kerrcaustics.curves.tubes import CausticTube
from kerrcaustics.draw import style
from kerrcaustics.draw.sky_axes import REACH, from_above, from_the_side
from kerrcaustics.draw.solids import CAPTURED_COLOUR, DISK_COLOUR, DISK_RIM_COLOUR
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import one_of


def space_points(
    ax: Axes,
    points: SpacePoints,
    plane: str = "xy",
    disk: tuple[float, float] | None = None,
    colour: str | None = None,
) -> Axes:
    """The paths as far as 20 M, the hole and a `disk` between two rims, from above or, `plane="xz"`, from the side.

    Rays have the colour of their Morse index, captured ones are grey, unless there is a `colour` for all.
    """
    one_of("plane", plane, get_args(PlaneName))
    horizon = kerr.horizon(points.spin)
    width = 2 * math.hypot(horizon, points.spin)
    ax.add_patch(Ellipse((0, 0), width, width if plane == "xy" else 2 * horizon, color="black"))
    _draw_disk(ax, points.spin, plane, disk)
    size = points.radius.shape[-1] if points.radius.ndim else 1
    near = np.where(points.radius < REACH, points.radius, np.nan)
    x, y, z = (part.reshape(-1, size).T for part in np.moveaxis(cartesian(points.spin, near, points.direction), -1, 0))
    drawn = ax.plot(x, y if plane == "xy" else z, linewidth=0.8, color=colour)
    if isinstance(points, RayPaths) and colour is None:
        _colour_rays(ax, points, drawn)
    return from_above(ax) if plane == "xy" else from_the_side(ax)


def _draw_disk(ax: Axes, spin: float, plane: str, disk: tuple[float, float] | None) -> None:
    """A disk between two radii, from above or on edge."""
    if disk is None:
        return
    inner, outer = (math.hypot(rim, spin) for rim in disk)
    if plane == "xy":
        ax.add_patch(Annulus((0, 0), outer, outer - inner, color=DISK_COLOUR, zorder=0))
        return
    for side in (-1, 1):
        ax.plot([side * inner, side * outer], [0, 0], color=DISK_RIM_COLOUR, linewidth=2.5, solid_capstyle="butt")


def _colour_rays(ax: Axes, paths: RayPaths, drawn: list[Line2D]) -> None:
    """Rays in the colours of their indices, captured ones grey, with a legend."""
    indices, statuses = np.ravel(paths.index).tolist(), np.ravel(paths.status).tolist()
    named = set(ax.get_legend_handles_labels()[1])
    for line, index, status in zip(drawn, indices, statuses, strict=True):
        captured = status == Status.CAPTURED
        words = "captured" if captured else f"index {index}"
        line.set(color=CAPTURED_COLOUR if captured else style.index_colour(max(index, 0)))
        line.set_label(words if words not in named and index >= 0 else "_ray")
        named.add(words)
    if named:
        ax.legend()


def path_beams(ax: Axes, beams: PathBeams) -> Axes:
    """The diameters of each beam from place to place, the minor one dashed."""
    size = beams.diameter_error.shape[-1] if beams.diameter_error.ndim else 1
    for values, look in ((beams.delta_plus, "-"), (beams.delta_minus, "--")):
        for i, line in enumerate(values.reshape(-1, size)):
            ax.plot(line, look, color=style.PALETTE[i % len(style.PALETTE)], linewidth=0.8)
    ax.axhline(0, color="black", linewidth=0.5)
    ax.set(xlabel="place", ylabel="diameters over the radius")
    return ax


def tube_rows(ax: Axes, tube: CausticTube) -> Axes:
    """The rows of the tube as far as 20 M."""
    return space_points(ax, tube.points)
