"""
The range of validity of waves computed from rays
=================================================

The reported error of `kc.amplification` (lines) and the true one (dots), as a fraction of the field, or of 1 where the
field is less than 1, for a hole without spin: partial waves, which share nothing with rays, give the truth. (a) A
source at 1.8 rad from the direction opposite to the viewer, where its images are far apart; (b) one beside the axis, at
0.05 rad, where they form a ring. The viewers are 3 M (next to the photon orbits), 10 M and 20 M from the hole. Below
the frequency of the dashed line, waves are longer than the hole, and errors grow to tens of per cent and more; below
0.05 the program refuses to compute them.

The paper has no such figure. Scalar waves, images of index 0 to 4.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.scripts import STUDIES

RADII, ANGLES, FREQUENCIES = (3.0, 10.0, 20.0), (1.8, 0.05), np.geomspace(0.05, 5, 41)
EVERY, LONG_WAVES, MAX_INDEX = 4, 0.25, 4


def main(output: Path) -> list[Path]:
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.2), layout="constrained")
        axes = figure.subplots(1, 2, sharey=True)
        for ax, letter, angle in zip(axes, "ab", ANGLES, strict=True):
            for radius, colour in zip(RADII, style.PALETTE, strict=False):
                draw_errors(ax, radius, angle, colour)
            ax.axvline(LONG_WAVES, color="0.5", linewidth=0.7, linestyle="--")
            ax.set(xscale="log", yscale="log", xlabel=r"$\omega M$", title=f"({letter}) {angle:g} rad from the axis")
        axes[0].set_ylabel("error, as a fraction of the field")
        axes[0].legend()
        marks = [Line2D([], [], color="0.3"), Line2D([], [], color="0.3", marker=".", linestyle="")]
        axes[1].legend(marks, ["reported", "true"])
    return write_line_art(figure, output, "wave_errors")


def draw_errors(ax: Axes, radius: float, angle: float, colour: str) -> None:
    """The errors of one source by frequency."""
    camera = kc.Camera(spin=0.0, radius=radius, velocity="static")
    seen = kc.amplification(camera, (math.pi / 2, math.pi - angle), FREQUENCIES, max_index=MAX_INDEX)
    size = np.maximum(np.abs(seen.value), 1)
    ax.plot(FREQUENCIES, seen.error / size, color=colour, linewidth=1.1, label=f"r = {radius:g} M")
    partial_waves = STUDIES.module("truth.partial_waves").field
    chosen = np.arange(0, len(FREQUENCIES), EVERY)
    truth = np.array([partial_waves(FREQUENCIES[i], radius, np.array([angle]))[0] for i in chosen])
    ax.plot(FREQUENCIES[chosen], np.abs(seen.value[chosen] - truth) / size[chosen], ".", color=colour, markersize=4)


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
