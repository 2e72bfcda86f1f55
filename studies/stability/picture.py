"""The picture of the study stability: true against reported errors of the problems, and the map."""

from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from kerrcaustics.draw.style import GUIDE_COLOUR, PAGE_WIDTH, PALETTE, RC, SMALLEST_TEXT

from .checks import HONEST
from .error_map import Cell

# Fails stand out by shape, too. Marks beyond the panel are put on its edge.
_MARKS = {
    "ok": {"color": PALETTE[2], "marker": "o", "markersize": 3.5},
    "honest": {"color": PALETTE[0], "marker": "o", "markersize": 3.5, "markerfacecolor": "white"},
    "FAIL": {"color": PALETTE[1], "marker": "X", "markersize": 6.5},
}
_LEAST_ERROR, _LEAST_RATIO, _MOST_RATIO = 1e-17, 1e-4, 2e3
_ALARM = "#fbeee6"


def picture(rows: list[dict[str, Any]], mapped: list[Cell]) -> Figure:
    """Ratio of true to reported error against true error, a panel for each engine, a mark for each problem; a map."""
    engines = list(dict.fromkeys(row["engine"] for row in rows))
    with rc_context(RC):
        figure = Figure(figsize=(PAGE_WIDTH, 6.6), layout="constrained")
        above, below = figure.subfigures(2, 1, height_ratios=(5, 7))
        panels = above.subplots(1, len(engines), sharex=True, sharey=True, squeeze=False)[0]
        for ax, engine in zip(panels, engines, strict=True):
            _draw_engine(ax, [row for row in rows if row["engine"] == engine])
            ax.set_title(engine.replace("-", " "))
        panels[0].set_ylabel("true / reported error, largest")
        above.supxlabel("true error of n′, largest of the problem (rad)", fontsize=RC["axes.labelsize"])
        marks = [Line2D([], [], linestyle="none", **mark) for mark in _MARKS.values()]
        # Most of the room is there.
        panels[-1].legend(marks, list(_MARKS), loc="lower right")
        _draw_map(below, mapped)
    return figure


def _draw_map(figure: SubFigure, mapped: list[Cell]) -> None:
    """Cells by spin and radius: a row each for n' and J, a column for each distance; without a truth a cell is grey."""
    gaps, heights, distances = (
        list(dict.fromkeys(getattr(cell, name) for cell in mapped)) for name in ("gap", "height", "distance")
    )
    panels = figure.subplots(2, len(distances), sharex=True, sharey=True, squeeze=False)
    norm, colours = LogNorm(_LEAST_RATIO, HONEST), colormaps["viridis"].with_extremes(over=_MARKS["FAIL"]["color"])
    for row, name in zip(panels, ("ratio", "j_ratio"), strict=True):
        for ax, distance in zip(row, distances, strict=True):
            values = [getattr(cell, name) for cell in mapped if cell.distance == distance]
            table = np.ma.masked_invalid(np.reshape(values, (len(gaps), len(heights))))
            mesh = ax.pcolormesh(table, norm=norm, cmap=colours, edgecolors="white", linewidth=0.5)
            ax.set_facecolor("#dddddd")
            # There is no room for all.
            ax.set_xticks(np.arange(len(heights))[::2] + 0.5, [_power(height) for height in heights[::2]])
            ax.set_yticks(np.arange(len(gaps)) + 0.5, [_power(gap) for gap in gaps])
            for axis in (ax.xaxis, ax.yaxis):
                axis.set_tick_params(length=0, labelsize=SMALLEST_TEXT)
    for ax, distance in zip(panels[0], distances, strict=True):
        ax.set_title("anywhere" if np.isinf(distance) else f"{_power(distance)} from the edge")
    for row, label in zip(panels, ("n′", "J"), strict=True):
        row[0].set_ylabel(f"{label}: 1 − a")
    figure.supxlabel("height of the camera above the horizon, r / r$_+$ − 1", fontsize=RC["axes.labelsize"])
    figure.colorbar(mesh, ax=panels, label="true / reported error of auto, largest", extend="both")


def _power(value: float) -> str:
    """A power of ten as one; other numbers as they are."""
    power = round(np.log10(value))
    return f"$10^{{{power}}}$" if abs(power) > 1 and np.isclose(value, 10.0**power, rtol=1e-9) else f"{value:g}"


def _draw_engine(ax: Axes, rows: list[dict[str, Any]]) -> None:
    ax.set(xscale="log", yscale="log", xlim=(3e-18, 20), ylim=(_LEAST_RATIO / 2, _MOST_RATIO))
    ax.axhspan(HONEST, _MOST_RATIO, color=_ALARM, zorder=0)
    ax.axhline(1, color=GUIDE_COLOUR, linewidth=0.8, zorder=1)
    ax.annotate(
        f"more than {HONEST:g} times what is reported",
        (0.03, 0.97),
        xycoords="axes fraction",
        va="top",
        fontsize=SMALLEST_TEXT,
        color="#777777",
    )
    for verdict, mark in _MARKS.items():
        here = [row for row in rows if row["verdict"] == verdict and row["truths"]]
        if not here:
            continue
        errors = [max(row["error"], _LEAST_ERROR) for row in here]
        ratios = [min(max(HONEST * row["ratio"], _LEAST_RATIO), _MOST_RATIO) for row in here]
        ax.plot(errors, ratios, linestyle="none", zorder=2, clip_on=False, **mark)
    ax.set(xticks=[1e-16, 1e-12, 1e-8, 1e-4, 1], yticks=[1e-4, 1e-2, 1, 1e2])
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_minor_locator(NullLocator())
