"""Caustics of many cameras side by side, on the same axes in each column."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import whole_line
from kerrcaustics.draw.sky_axes import draw_mark, is_shapeless, outside_on_two_lines

_ROW_HEIGHT = 1.25
# Part of the width of a page for the columns of order 1, 2, 3, ...
_WIDTHS = (1.0, 1.3, 2.1)
# Half the width of the panel of a primary caustic over the caustic's.
_OWN_SCALE = 0.8


def caustic_axes(ax: Axes, caustic: Caustic, half: float | None = None) -> Axes:
    """Draw a caustic and its extents in words: theta' (0 at the top) against unwrapped phi', in degrees.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    caustic : Caustic
    half : float, optional
        Half the width of the panel in radians; it then shows offsets from the middle of the caustic.
    """
    curve = np.degrees(whole_line(caustic.celestial, caustic.closed)[:, ::-1])
    if is_shapeless(caustic):
        curve = curve[:1]
    if half is not None:
        curve -= (curve.min(axis=0) + curve.max(axis=0)) / 2
        limit = math.degrees(half)
        ax.set(xlim=(-limit, limit), ylim=(limit, -limit))
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_locator(MaxNLocator(4, symmetric=True, steps=[1, 2, 5, 10]))
    else:
        ax.set_ylim(180, 0)
        ax.yaxis.set_major_locator(MultipleLocator(90))
    if is_shapeless(caustic):
        draw_mark(ax, caustic, curve[0])
    else:
        ax.plot(*curve.T, **style.order_line(caustic.order))
    ax.annotate(_words(caustic), (0.02, 0.94), xycoords="axes fraction", va="top", fontsize=style.SMALLEST_TEXT)
    return ax


def _words(caustic: Caustic) -> str:
    """Widths in phi' and theta'."""
    if is_shapeless(caustic):
        return "a point" if caustic.kind == "point" else "unresolved"
    widths = (math.degrees(extent) for extent in (caustic.phi_extent, caustic.theta_extent))
    return " × ".join(f"{width:.3g}" if width < 1000 else f"{width:.0f}" for width in widths) + " deg"


def multiples_figure(rows: Mapping[str, CausticSet], title: str) -> Figure:
    """Figure of the caustics of several cameras: one row a camera, one column an order, 7 inches wide.

    Parameters
    ----------
    rows : mapping of str to CausticSet
        Caustics of order 1 to 3 or fewer, the same orders in each, and the name of their camera.
    title : str

    Notes
    -----
    Axes are the same down a column, but for the primary caustic, which is drawn about its own middle at its own scale.
    """
    orders = [caustic.order for caustic in next(iter(rows.values()))]
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, _ROW_HEIGHT * len(rows) + 0.85), layout="constrained")
        panels = figure.subplots(len(rows), len(orders), squeeze=False, width_ratios=_WIDTHS[: len(orders)])
        for column, order in enumerate(orders):
            row = [caustics[column] for caustics in rows.values()]
            (_own_scales if order == 1 else _common_scale)(list(panels[:, column]), row)
            panels[0, column].set_title(f"{style.order_name(order)} caustic")
            name = "φ′ − middle (deg)" if order == 1 else "φ′ (deg)"
            panels[-1, column].set_xlabel(outside_on_two_lines(name))
            if order > 1:
                for ax in panels[:, column]:
                    ax.set_ylabel("θ′ (deg)")
        for ax, name in zip(panels[:, 0], rows, strict=True):
            ax.set_ylabel(f"{name}\nθ′ − middle (deg)")
        figure.suptitle(f"{title}; widths in φ′ × in θ′")
    return figure


def _own_scales(panels: Sequence[Axes], row: list[Caustic]) -> None:
    """Show each caustic about its own middle, on a scale of its own."""
    for ax, caustic in zip(panels, row, strict=True):
        width = max(caustic.theta_extent, caustic.phi_extent)
        caustic_axes(ax, caustic, math.radians(0.5) if is_shapeless(caustic) else _OWN_SCALE * width)


def _common_scale(panels: Sequence[Axes], row: list[Caustic]) -> None:
    """The same phi' in all panels, which the lowest names."""
    low, high = (math.degrees(f) for f in (min(c.phi_min for c in row), max(c.phi_max for c in row)))
    for ax, caustic in zip(panels, row, strict=True):
        caustic_axes(ax, caustic)
        _common_axis(ax, low, high)
        ax.tick_params(labelbottom=ax is panels[-1])


def _common_axis(ax: Axes, low: float, high: float) -> None:
    """phi' from `low` to `high` degrees with a little room; faint verticals at whole turns."""
    room = 0.04 * (high - low)
    ax.set_xlim(low - room, high + room)
    ax.xaxis.set_major_locator(MultipleLocator(style.tick_step(high - low, 5)))
    for turn in range(math.ceil((low - room) / 360), math.floor((high + room) / 360) + 1):
        ax.axvline(360 * turn, color=style.GUIDE_COLOUR, linewidth=0.5, zorder=0.5)
