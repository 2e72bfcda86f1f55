"""The picture of the study `error_time`: small multiples, each with all points in grey and some in colour."""

import math
from typing import Any, NamedTuple

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator, NullLocator

from kerrcaustics.draw.style import PAGE_WIDTH, PALETTE, RC, SMALLEST_TEXT

from .points import Point


class Label(NamedTuple):
    """Words of a line, its place from the first or the last point of it (points of print), and which of both."""

    text: str
    offset: tuple[float, float]
    last: bool = False


PANELS = {
    "Rays and beams": ("rays",),
    "Caustics and stars": ("curves", "stars"),
    "Light curves": ("light",),
    "Discs and waves": ("discs", "waves"),
    "Disks and rings": ("disks",),
    "Pictures": ("pictures",),
}
"""Panels, and their families."""
_GREY, _FLOOR = "#d4d4d4", 1e-16
_TIMES, _ERRORS = (0.15, 4e7), (1e-16, 3.0)


def draw(points: list[Point], beam: float) -> Figure:
    """Error against time in units of a beam's, a panel for each group of families."""
    with rc_context(RC):
        figure = Figure(figsize=(PAGE_WIDTH, 5.4), layout="constrained")
        panels = figure.subplots(2, 3, sharex=True, sharey=True)
        for ax, (title, families) in zip(panels.ravel(), PANELS.items(), strict=True):
            _draw_panel(ax, points, families, beam)
            ax.set_title(title)
        figure.supxlabel("time on one core, in beams", fontsize=RC["axes.labelsize"])
        figure.supylabel("error", fontsize=RC["axes.labelsize"])
    return figure


def _draw_panel(ax: Axes, points: list[Point], families: tuple[str, ...], beam: float) -> None:
    others = [point for point in points if point.family not in families]
    style = {"color": _GREY, "markersize": 2.2, "linestyle": "none", "zorder": 1, "markeredgewidth": 0}
    ax.plot([p.seconds / beam for p in others], [_shown(p.error) for p in others], "o", **style)
    chosen = [point for point in points if point.family in families]
    for colour, line in zip(PALETTE, dict.fromkeys(point.line for point in chosen), strict=False):
        _draw_line(ax, [point for point in chosen if point.line == line], colour, beam)
    ax.set(xscale="log", yscale="log", xlim=_TIMES, ylim=_ERRORS)
    ax.xaxis.set_major_locator(LogLocator(numticks=9))
    ax.yaxis.set_major_locator(FixedLocator([10.0**k for k in range(-15, 1, 3)]))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_minor_locator(NullLocator())
    ax.grid(color="#ececec", linewidth=0.5)


def _draw_line(ax: Axes, points: list[Point], colour: str, beam: float) -> None:
    """Points of a line, joined in the order of time, and from each a thin line up to the reported error."""
    ordered = sorted(points, key=lambda point: point.seconds)
    times, errors = [p.seconds / beam for p in ordered], [_shown(p.error) for p in ordered]
    for point, time, error in zip(ordered, times, errors, strict=True):
        if math.isfinite(point.reported):
            ax.plot([time, time], [error, _shown(point.reported)], "-", color=colour, linewidth=0.8, alpha=0.55)
            ax.plot([time], [_shown(point.reported)], "_", color=colour, markersize=4, alpha=0.8)
    faces = ["white" if point.bound else colour for point in ordered]
    ax.plot(times, errors, "-", color=colour, linewidth=0.9)
    for time, error, face in zip(times, errors, faces, strict=True):
        ax.plot([time], [error], "o", color=colour, markersize=3.4, markerfacecolor=face, markeredgewidth=0.9)
    label = LABELS.get(ordered[0].line, Label(ordered[0].line, (4, 4)))
    place = (times[-1], errors[-1]) if label.last else (times[0], errors[0])
    side = "left" if label.offset[0] >= 0 else "right"
    words: dict[str, Any] = {"textcoords": "offset points", "fontsize": SMALLEST_TEXT, "color": colour, "ha": side}
    ax.annotate(label.text, place, label.offset, va="center", **words)


def _shown(error: float) -> float:
    return max(error, _FLOOR)


LABELS: dict[str, Label] = {}
"""Labels of the lines; others stand above their first point."""
