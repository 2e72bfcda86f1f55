"""The picture of the study adversary: which share of the claims is off by more than so many reported errors."""

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.draw.style import GUIDE_COLOUR, PAGE_WIDTH, PALETTE, RC

from .claims import ERRORS
from .tally import LIMITS, Tally

_LEAST = 1e-7


def picture(tally: Tally) -> Figure:
    """A panel for each engine, a line for each claim that is a number with an error, all tolerances together."""
    engines = list(dict.fromkeys(group.split(",")[0] for kind, group, _ in tally.counts if kind == "trial"))
    with rc_context(RC):
        figure = Figure(figsize=(PAGE_WIDTH, 2.9), layout="constrained")
        panels = figure.subplots(1, len(engines), sharex=True, sharey=True, squeeze=False)[0]
        for ax, engine in zip(panels, engines, strict=True):
            _draw_engine(ax, tally, engine)
            ax.set_title(engine.replace("-", " "))
        panels[0].set_ylabel("share of the claims beyond")
        panels[-1].legend()
        figure.supxlabel("true / reported error", fontsize=RC["axes.labelsize"])
    return figure


def _draw_engine(ax: Axes, tally: Tally, engine: str) -> None:
    for claim, colour in zip(ERRORS, PALETTE, strict=False):
        groups = [key for key in tally.counts if key[0] == "trial" and key[1].startswith(engine) and key[2] == claim]
        counts = np.sum([tally.counts[key] for key in groups], axis=0)
        if counts[0]:
            ax.plot(LIMITS, np.maximum(counts[1:] / counts[0], _LEAST), color=colour, marker="o", label=claim)
    ax.axvline(10, color=GUIDE_COLOUR, linewidth=0.8, zorder=0)
    ax.set(xscale="log", yscale="log", ylim=(_LEAST, 1))
