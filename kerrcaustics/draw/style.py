"""The look of every plot: fonts, sizes, colours and lines of orders and indices, letters and crosses."""

import math
import string
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from kerrcaustics.draw import palettes
from kerrcaustics.shapes import Bool, Float

PAGE_WIDTH = 7.0
"""Width in inches of a picture that fills a journal page."""

SMALLEST_TEXT = 7.0
"""Size in points of the smallest text, when the picture is printed at its own size."""

LETTER_DISTANCE = 7.0
"""Points of type from a cusp to the middle of its letter."""

SHADOW = {"facecolor": "#e4e4e4", "edgecolor": "#8c8c8c", "linewidth": 0.6}
GUIDE_COLOUR = "#c8c8c8"
CRITICAL: dict[str, Any] = {"color": "#9a9a9a", "linewidth": 0.7, "linestyle": (0, (3, 2))}
"""Critical curves of all orders, behind tracks."""

# Marks of pairs of images that are created and annihilated.
EVENTS = {"creation": "^", "annihilation": "v"}

PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours of Okabe and Ito, which colour-blind readers can distinguish: for what is no order and no index."""

DASHES = ("-", (0, (4, 1.5)), (0, (1.2, 1.2)), (0, (5, 1.5, 1.2, 1.5)))

RC: dict[Any, Any] = {
    "axes.edgecolor": "#555555",
    "axes.labelpad": 3.0,
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.titlepad": 4.0,
    "axes.titlesize": 8.5,
    "figure.titlesize": 9.5,
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "lines.linewidth": 1.1,
    "lines.solid_capstyle": "round",
    "lines.solid_joinstyle": "round",
    "savefig.dpi": 200,
    "xtick.labelsize": 7.5,
    "xtick.major.size": 3.0,
    "xtick.major.width": 0.6,
    "ytick.labelsize": 7.5,
    "ytick.major.size": 3.0,
    "ytick.major.width": 0.6,
}
"""Settings for `matplotlib.rc_context`, under which the figure and its artists are made."""

FILM_RC: dict[Any, Any] = {
    **RC,
    "font.size": 10.5,
    "axes.labelsize": 10.5,
    "axes.titlesize": 12.0,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "legend.fontsize": 9.5,
}
"""The same for frames of films, which are seen at 100 pixels an inch."""

_STEPS = (
    *(m / 10**n for n in range(12, 0, -1) for m in (1, 2, 5)),
    *(1, 2, 5, 10, 15, 30, 45, 60, 90, 180, 360, 720, 1080, 1800, 3600, 7200, 18000),
)
_NAMES = ("primary", "secondary", "tertiary")


def order_colour(order: int | np.integer, on_black: bool = False) -> str:
    """Colour of critical curves and caustics of an order (1, 2, 3, ...), the same in every plot."""
    palette = palettes.ORDER_ON_BLACK if on_black else palettes.ORDER
    return palette[(order - 1) % len(palette)]


def index_colour(index: int | np.integer, on_black: bool = False) -> str:
    """Colour of images of a Morse index (0, 1, 2, ...), the same in every plot."""
    palette = palettes.INDEX_ON_BLACK if on_black else palettes.INDEX
    return palette[index % len(palette)]


def crossing_colour(crossing: int | np.integer) -> str:
    """Colour of what is seen at a crossing of the plane (1, 2, 3, ...): that of images of one index less."""
    return index_colour(max(crossing, 1) - 1)


def order_line(order: int | np.integer, on_black: bool = False) -> dict[str, Any]:
    """Line settings of an order: its colour, and its dashes, which differ where colours repeat."""
    dashes = DASHES[(order - 1) // len(palettes.ORDER) % len(DASHES)]
    return {"color": order_colour(order, on_black), "linestyle": dashes}


def index_line(index: int | np.integer, on_black: bool = False) -> dict[str, Any]:
    """Line settings of an index: its colour, and its dashes, which differ where colours repeat."""
    dashes = DASHES[index // len(palettes.INDEX) % len(DASHES)]
    return {"color": index_colour(index, on_black), "linestyle": dashes}


def crossing_line(crossing: int | np.integer) -> dict[str, Any]:
    """Line settings of a crossing of the plane."""
    return index_line(max(crossing, 1) - 1)


def order_name(order: int | np.integer) -> str:
    """Name of an order: primary, secondary, tertiary, 4th order, 5th order, ..."""
    return _NAMES[order - 1] if order <= len(_NAMES) else f"{order}th order"


def number(value: float | np.floating | np.integer, form: str = "g") -> str:
    """A number in words of a picture: with a minus sign, which is longer than a hyphen."""
    return format(value, form).replace("-", "−")


def tick_step(span: float, most: int) -> float:
    """Smallest round number of degrees that puts at most `most` ticks in a span."""
    return next((step for step in _STEPS if span / step <= most), _STEPS[-1])


def draw_cross(ax: Axes, point: Float[np.ndarray, "2"], order: int | np.integer, remark: str = "") -> None:
    """A cross at a point (2,), for a caustic that is one; remark: what its name goes on with."""
    cross: dict[str, Any] = {"linestyle": "none", "marker": "x", "markersize": 7, "markeredgewidth": 1.4}
    ax.plot(*point[:, None], clip_on=False, color=order_colour(order), label=order_name(order) + remark, **cross)


def draw_computed(ax: Axes, x: Float[np.ndarray, " n"], y: Float[np.ndarray, " n"], log: str = "", **line: Any) -> None:
    """Dots at computed points and a curve without kinks through them, of one colour.

    The curve is Akima's, modified so that it hardly overshoots, in the logarithms of the coordinates that `log` names
    ("x", "y", "xy").
    """
    from scipy.interpolate import Akima1DInterpolator

    finite = np.isfinite(x) & np.isfinite(y)
    points = [np.log(part[finite]) if name in log else part[finite] for name, part in (("x", x), ("y", y))]
    if finite.sum() > 1:
        order = np.argsort(points[0])
        fine = np.linspace(points[0].min(), points[0].max(), 400)
        points = [fine, Akima1DInterpolator(points[0][order], points[1][order], method="makima")(fine)]
    curve = [np.exp(part) if name in log else part for name, part in zip("xy", points, strict=True)]
    (smooth,) = ax.plot(*curve, **line)
    ax.plot(x, y, ".", color=smooth.get_color(), alpha=smooth.get_alpha(), markersize=2.5, linestyle="none")


def draw_letters(
    ax: Axes,
    points: Float[np.ndarray, "n 2"],
    offsets: Float[np.ndarray, "n 2"],
    order: int | np.integer,
    leader: bool = False,
    shown: Bool[np.ndarray, " n"] | None = None,
) -> None:
    """Dots at points (n, 2) and the letters A, B, ... at offsets (n, 2) in points of type from them.

    leader: letters that are not beside their dots are joined to them by a thin line; shown (n,): which.
    """
    colour = order_colour(order)
    arrow = {"arrowstyle": "-", "color": colour, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 0}
    look = {"ha": "center", "va": "center_baseline", "fontsize": SMALLEST_TEXT, "color": colour}
    for i, (point, offset) in enumerate(zip(points, offsets, strict=True)):
        if shown is not None and not shown[i]:
            continue
        ax.plot(*point[:, None], linestyle="none", marker="o", markersize=2.6, color=colour)
        far = leader and math.hypot(*offset) > 1.2 * LETTER_DISTANCE
        letter: dict[str, Any] = {"arrowprops": arrow if far else None, "textcoords": "offset points", **look}
        text = ax.annotate(string.ascii_uppercase[i % 26], point, tuple(offset), **letter)
        # A letter outside its panel, on limits chosen by others, must not squeeze the layout.
        text.set_in_layout(False)


def event_mark(kind: str) -> dict[str, Any]:
    """The mark of a pair event of a kind: the settings of a line."""
    edge = {"color": "black", "markerfacecolor": "white", "markeredgewidth": 0.9}
    return {"marker": EVENTS.get(kind, "o"), "markersize": 5.5, "linestyle": "none", "zorder": 3, **edge}


def log_axis(ax: Axes, low: float, high: float, ticks: int) -> None:
    """A logarithmic vertical axis with few ticks."""
    ax.set(yscale="log", ylim=(low, high))
    ax.yaxis.set_major_locator(LogLocator(numticks=ticks))
    ax.yaxis.set_minor_locator(NullLocator())
