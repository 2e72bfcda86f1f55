"""The figure of the study far_camera."""

from typing import Any

import numpy as np
import xarray
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from kerrcaustics.draw import style

from .tube import Section

# Opacity of a slow hole's lines.
_FAINT, _LINE = 0.35, {"color": "#555555", "linewidth": 0.8, "zorder": 0}
_SYMBOLS = {"across": "s", "along": "o"}


def plain_ticks(axis: Axis) -> None:
    """Ticks at 1, 2, 5, 10, ... of a logarithmic axis, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def width_panel(ax: Axes, grid: xarray.Dataset, sections: list[list[Section]], width: float, other: float) -> None:
    """Widths of the primary caustic and of tubes, in a^2 / r^2 (and sin^2 i), against radius."""
    colour, radius = style.order_colour(1), grid.radius.values
    spins = grid.spin.values
    for spin, alpha in ((spins.min(), _FAINT), (spins.max(), 1.0)):
        row = grid.sel(spin=spin, order=1).squeeze("inclination")
        for name, dashes in (("phi", "-"), ("theta", style.DASHES[1])):
            values = np.radians(row[f"{name}_extent"].values) * (radius / spin) ** 2
            style.draw_computed(ax, radius, values, "x", color=colour, alpha=alpha, linestyle=dashes)
    mark: dict[str, Any] = {"color": "black", "linestyle": "none", "markersize": 3, "fillstyle": "none"}
    fastest = max((cuts for cuts in sections), key=lambda cuts: (cuts[0].spin, cuts[0].inclination))
    for name, symbol in _SYMBOLS.items():
        values = [getattr(cut, name).value for cut in fastest]
        ax.plot([cut.radius for cut in fastest], values, marker=symbol, **mark)
    for height, word in ((width, "15π/128"), (other, f"{other:g}")):
        ax.axhline(height, **_LINE)
        ax.annotate(
            word, (1, height), (-3, 2), xycoords=("axes fraction", "data"), textcoords="offset points", ha="right"
        )
    plain: dict[str, Any] = {"color": colour}
    handles = [
        Line2D([], [], **plain, label="camera: width in φ′"),
        Line2D([], [], **plain, linestyle=style.DASHES[1], label="in θ′"),
        Line2D([], [], **mark, marker="o", label="tube: along φ"),
        Line2D([], [], **mark, marker="s", label="across"),
    ]
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 0.02))
    ax.set(xscale="log", ylim=(None, width + 0.006), xlabel="radius r (M)", ylabel="full width × r²/a²")
    plain_ticks(ax.xaxis)
    ax.set_title(f"primary caustic, a = {spins.max():g} (pale: a = {spins.min():g})")


def shift_panel(ax: Axes, grid: xarray.Dataset, shift: float) -> None:
    """Excess of the displacement of the primary caustic's middle over a / r, in a / r^(3/2), against 1 / sqrt(r)."""
    x = grid.radius.values**-0.5
    spins = grid.spin.values
    for spin, alpha in ((spins.min(), _FAINT), (spins.max(), 1.0)):
        row = grid.sel(spin=spin, order=1).squeeze("inclination")
        values = (180 - (row.phi_min + row.phi_max).values / 2) * np.pi / 180 / (spin * x**2)
        style.draw_computed(ax, x, (values - 1) / x, color=style.order_colour(1), alpha=alpha, label=f"a = {spin:g}")
    ax.axhline(shift, **_LINE)
    ax.annotate(
        "5π/32", (1, shift), (-3, 2), xycoords=("axes fraction", "data"), textcoords="offset points", ha="right"
    )
    ax.set(xlim=(0, None), xlabel="1 / √r", ylabel="((π − φ′) × r/a − 1) × √r")
    ax.legend()
    ax.set_title("shift of the primary caustic, beyond a/r")


def spin_panel(ax: Axes, found: list[Any], heads: tuple[str, str]) -> None:
    """Widths of higher orders at infinite radius, in a^2, against spin."""
    for order in sorted({one.order for one in found}):
        rows = [one for one in found if one.order == order]
        for name, dashes in (("phi", "-"), ("theta", style.DASHES[1])):
            values = [getattr(one, name).value for one in rows]
            label = style.order_name(order) if name == "phi" else None
            line = {"color": style.order_colour(order), "linestyle": dashes, "label": label}
            style.draw_computed(ax, np.array([r.spin for r in rows]), np.array(values), "y", **line)
    ax.set(yscale="log", xlim=(0, 1), xlabel="spin a", ylabel=heads[1])
    ax.legend(loc="upper left")
    plain_ticks(ax.yaxis)
    ax.set_title(heads[0])


def drift_panel(ax: Axes, found: list[Any], drift: float) -> None:
    """Lag behind the order before, in a, at infinite radius, against spin."""
    lags = {(one.order, one.spin): one.lag.value for one in found}
    for order in sorted({one.order for one in found}):
        spins = [one.spin for one in found if one.order == order]
        values = [lags[order, spin] - lags.get((order - 1, spin), 0.0) for spin in spins]
        line = {"color": style.order_colour(order), "label": f"order {order - 1} to {order}"}
        style.draw_computed(ax, np.array(spins), np.array(values), "y", **line)
    ax.axhline(drift, **_LINE)
    ax.annotate(
        "2π/(3√3)",
        (1, drift),
        (-3, -3),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        va="top",
    )
    ax.set(yscale="log", xlim=(0, 1), xlabel="spin a", ylabel="drift / a")
    plain_ticks(ax.yaxis)
    ax.legend(loc="upper left")
    ax.set_title("drift from order to order, at infinite radius")


def picture(
    grid: xarray.Dataset, sections: list[list[Section]], found: list[Any], lines: tuple[float, float, float, float]
) -> Figure:
    """The figure; lines: width of the primary caustic, the other value of it, second term of the shift, drift."""
    width, other, shift, drift = lines
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.4), layout="constrained")
        places = figure.subplots(2, 2)
        width_panel(places[0, 0], grid, sections, width, other)
        shift_panel(places[0, 1], grid, shift)
        heads = ("at infinite radius: φ′ (solid), θ′ (dashed)", "full width / a²")
        spin_panel(places[1, 0], found, heads)
        drift_panel(places[1, 1], found, drift)
    return figure
