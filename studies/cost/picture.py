"""The picture of the study `cost`."""

from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.draw.style import PALETTE, RC, SMALLEST_TEXT

ENGINES = {"closed-form": PALETTE[1], "integrated": PALETTE[0]}
# The stages of a call, in their order: words and colour.
_STAGES = {
    "start": ("start, imports", "#b5b5b5"),
    "tracing": ("tracing", PALETTE[2]),
    "rest": ("Python, NumPy", PALETTE[4]),
}
_ROW, _ROOM = 0.2, 0.55
_LABEL: dict[str, Any] = {"fontsize": SMALLEST_TEXT, "textcoords": "offset points"}

Found = dict[str, list[float]]


def draw(found: Found, noise: Found, names: list[str], lines: dict[str, Any], first: dict[str, Any]) -> Figure:
    """Panels of rays and beams by engine, of the lines by stage, and of the first use."""
    heights = [2.5, *(_ROOM + _ROW * len(rows) for rows in (lines, first) if rows)]
    with rc_context(RC):
        figure = Figure(figsize=(4.8, sum(heights)), layout="constrained")
        # Each with the room that its own words need.
        parts = figure.subfigures(len(heights), squeeze=False, height_ratios=heights)[:, 0]
        panels = [part.subplots() for part in parts]
        draw_engines(panels[0], found, noise, names)
        if lines:
            draw_lines(panels[1], lines)
        if first:
            draw_first(panels[-1], first)
    return figure


def draw_engines(ax: Axes, found: Found, noise: Found, names: list[str]) -> None:
    """Bars of microseconds, a group for each scene; whiskers up to the slower round."""
    for k, (engine, times) in enumerate(found.items()):
        name = "closed form" if engine == "closed-form" else engine
        for i, time in enumerate(times):
            place = i + 0.38 * (k - 0.5)
            slower = {"yerr": [[0], [noise[engine][i]]], "error_kw": {"linewidth": 0.8, "capsize": 2}}
            ax.bar(place, time, 0.36, color=ENGINES[engine], label=name if i == 0 else None, **slower)
            ax.annotate(f"{time:.2f}", (place, time + noise[engine][i]), (0, 2), ha="center", **_LABEL)
    ax.set_xticks(range(len(names)), names)
    ax.set_ylabel("time on one core (µs)")
    ax.margins(y=0.12)
    _legend(ax)
    ax.spines[["top", "right"]].set_visible(False)


def draw_lines(ax: Axes, lines: dict[str, Any]) -> None:
    """Parts of a later call on one core, and beside them its time, also in that of its rays and beams alone."""
    rows = [one["later"] for one in lines.values()]
    _bars(ax, list(lines), [{name: 100 * t / sum(row.values()) for name, t in row.items()} for row in rows])
    ratios = [one["ratio"] for one in lines.values()]
    texts = [
        ("time", "× beams"),
        *((_in_words(sum(row.values())), f"{r:.{1 if r < 100 else 0}f}") for row, r in zip(rows, ratios, strict=True)),
    ]
    for i, both in enumerate(texts):
        for text, right in zip(both, (36, 72), strict=True):
            look = _LABEL | {"ha": "right", "va": "center_baseline", "annotation_clip": False}
            ax.annotate(text, (100, i - 1), (right, 0), **look)
    ax.set_xlim(0, 100)
    ax.set_xlabel("part of a call on one core (%)")


def draw_first(ax: Axes, first: dict[str, dict[str, float]]) -> None:
    """Seconds of the first use, by stage."""
    rows = list(first.values())
    _bars(ax, list(first), rows)
    for i, row in enumerate(rows):
        ax.annotate(f"{sum(row.values()):.2f} s", (sum(row.values()), i), (3, 0), va="center_baseline", **_LABEL)
    ax.margins(x=0.1)
    ax.set_xlim(left=0)
    ax.set_xlabel("first use in a new process (s)")


def _bars(ax: Axes, names: list[str], rows: list[dict[str, float]]) -> None:
    """Bars from top to bottom, of stages one after the other."""
    stages = [stage for stage in _STAGES if stage in rows[0]]
    for i, row in enumerate(rows):
        left = 0.0
        for stage in stages:
            ax.barh(i, row[stage], 0.72, left, color=_STAGES[stage][1], label=_STAGES[stage][0] if i == 0 else None)
            left += row[stage]
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.tick_params(axis="y", length=0)
    _legend(ax)
    ax.spines[["top", "right"]].set_visible(False)


def _legend(ax: Axes) -> None:
    """A legend in one row above the panel."""
    room: dict[str, Any] = {"handlelength": 1.0, "handletextpad": 0.4, "columnspacing": 1.0, "borderaxespad": 0.2}
    look: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0, 1), "frameon": False, "fontsize": SMALLEST_TEXT}
    ax.legend(ncols=len(_STAGES), **look, **room)


def _in_words(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds >= 1 else f"{1e3 * seconds:.{1 if seconds < 0.1 else 0}f} ms"
