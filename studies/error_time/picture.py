"""The picture of the study `error_time`: small multiples, by families of results."""

import math
from typing import Any, NamedTuple

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator, NullLocator

from kerrcaustics.draw.style import PAGE_WIDTH, PALETTE, RC, SMALLEST_TEXT

from .points import Point


class Label(NamedTuple):
    """Words of a line, their place from one of its points (points of print), and which of these."""

    text: str
    offset: tuple[float, float]
    point: int = 0


PANELS = {
    "Rays and beams": ("rays",),
    "Caustics and stars": ("curves", "stars"),
    "Light curves": ("light",),
    "Discs and waves": ("discs", "waves"),
    "Disks and rings": ("disks",),
    "Pictures": ("pictures",),
}
"""Panels, and their families."""
_FLOOR, _ERRORS = 1e-16, (1e-16, 9.0)
# Room beside the first and the last point of a panel, in times.
_BEFORE, _AFTER = 3.0, 8.0


def draw(points: list[Point], beam: float) -> Figure:
    """Error against time in units of a beam's, a panel for each group of families."""
    with rc_context(RC):
        figure = Figure(figsize=(PAGE_WIDTH, 5.2), layout="constrained")
        panels = figure.subplots(2, 3, sharey=True)
        for ax, (title, families) in zip(panels.ravel(), PANELS.items(), strict=True):
            _draw_panel(ax, [point for point in points if point.family in families], beam)
            ax.set_title(title)
        figure.supxlabel("time on one core, in beams", fontsize=RC["axes.labelsize"])
        figure.supylabel("error", fontsize=RC["axes.labelsize"])
    return figure


def _draw_panel(ax: Axes, points: list[Point], beam: float) -> None:
    for colour, line in zip(PALETTE, dict.fromkeys(point.line for point in points), strict=False):
        _draw_line(ax, [point for point in points if point.line == line], colour, beam)
    times = [point.seconds / beam for point in points] or [1.0]
    ax.set(xscale="log", yscale="log", xlim=(min(times) / _BEFORE, max(times) * _AFTER), ylim=_ERRORS)
    ax.xaxis.set_major_locator(LogLocator(numticks=5))
    ax.yaxis.set_major_locator(FixedLocator([10.0**k for k in range(-15, 1, 3)]))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_minor_locator(NullLocator())
    ax.grid(color="#ececec", linewidth=0.5)


def _draw_line(ax: Axes, points: list[Point], colour: str, beam: float) -> None:
    """Points of a line, those of one engine joined, and from each a thin line to the reported error."""
    for engine in dict.fromkeys(_engine(point) for point in points):
        joined = [point for point in points if _engine(point) == engine]
        times, errors = [p.seconds / beam for p in joined], [_shown(p.error) for p in joined]
        ax.plot(times, errors, "-", color=colour, linewidth=0.9)
        for point, time, error in zip(joined, times, errors, strict=True):
            if math.isfinite(point.reported):
                ax.plot([time, time], [error, _shown(point.reported)], "-", color=colour, linewidth=0.7, alpha=0.45)
                ax.plot([time], [_shown(point.reported)], "_", color=colour, markersize=4, alpha=0.7)
            face = "white" if point.bound else colour
            ax.plot([time], [error], "o", color=colour, markersize=3.2, markerfacecolor=face, markeredgewidth=0.9)
    label = LABELS.get(points[0].line, Label(points[0].line, (5, 5)))
    # A quick study has fewer points.
    named = points[max(min(label.point, len(points) - 1), -len(points))]
    words: dict[str, Any] = {"textcoords": "offset points", "fontsize": SMALLEST_TEXT, "color": colour, "va": "center"}
    place = named.seconds / beam, _shown(named.error)
    side = "left" if label.offset[0] > 0 else "right" if label.offset[0] < 0 else "center"
    # The panel's size must not depend on its words.
    ax.annotate(label.text, place, label.offset, ha=side, **words).set_in_layout(False)


def _engine(point: Point) -> str:
    """What comes before the tolerance in a setting, if there is one."""
    return point.setting.partition(", ")[0] if point.family in ("rays", "curves") else ""


def _shown(error: float) -> float:
    return max(error, _FLOOR)


LABELS = {
    "ray": Label("ray: n′", (-2, 34), 1),
    "beam": Label("beam: width", (6, 0), -2),
    "three caustics": Label("three caustics", (4, -9), 1),
    "images of a star": Label("images of a star", (1, 22)),
    "their magnification": Label("magnification", (1, 27)),
    "pair events": Label("pair events", (1, -9)),
    "tracks": Label("tracks", (6, 5)),
    "light curve, point": Label("point", (6, -3)),
    "light curve, spot": Label("spot, by points", (6, 12)),
    "light curve, ball": Label("ball, by size", (0, 11)),
    "disc away from a caustic": Label("off a caustic", (1, 27)),
    "disc on a caustic, no spin": Label("disc on a caustic", (6, 0)),
    "disc on a fold": Label("disc on a fold", (-6, 0)),
    "waves, no spin": Label("waves, by frequency", (7, -6), -1),
    "waves on folds and cusps": Label("on folds", (7, 0)),
    "isoradials": Label("isoradials", (5, -7)),
    "line profile": Label("line profile, by beams", (0, -12), 2),
    "ring visibility": Label("ring visibility", (6, -3)),
    "frame": Label("frame: draft to high", (0, -11)),
    "frame of rays alone": Label("rays: 1, 4, 16", (1, -11)),
}
"""Labels of the lines; others stand beside their first point."""
