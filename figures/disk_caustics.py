"""
Where a disk meets caustics
===========================

The equatorial plane of a hole of spin 0.998, seen from r = 1000: where caustics meet it at the second crossing of rays
(above) and at the third (below), for three inclinations of the camera, which is to the right. A spot that crosses such
a curve gains two images, or loses two. Black: the hole; dotted: the innermost stable orbit.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.sky_axes import draw_from_above
from kerrcaustics.spacetime import kerr

SPIN, RADIUS = 0.998, 1000.0
INCLINATIONS, CROSSINGS = (20.0, 45.0, 60.0), {2: "second", 3: "third"}
WIDEST = 6.0


def panel(ax: Axes, inclination: float, crossing: int) -> None:
    camera = kc.Camera(SPIN, RADIUS, math.radians(inclination), "fiducial")
    curves = kc.caustics(camera, 4, end=kc.EquatorialPlane(crossing))
    if not curves:
        ax.annotate("no caustic", (0, -2.4), ha="center")
    for curve in curves:
        draw_from_above(ax, curve, linewidth=0.8, label=f"{style.order_name(curve.order)} caustic")
    turn = np.linspace(0, 2 * math.pi, 200)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    ax.fill(*kerr.horizon(SPIN) * circle, color="#1a1a1a", linewidth=0, zorder=3)
    ax.plot(*kerr.isco(SPIN) * circle, ":", color="#1a1a1a", linewidth=0.9, zorder=3)
    ax.set(xlim=(-WIDEST, WIDEST), ylim=(-WIDEST, WIDEST), aspect="equal")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MultipleLocator(3))


def main(output: Path) -> list[Path]:
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.3), layout="constrained")
        axes = figure.subplots(len(CROSSINGS), len(INCLINATIONS), sharex=True, sharey=True)
        for row, (crossing, name) in zip(axes, CROSSINGS.items(), strict=True):
            row[0].set_ylabel(f"{name} crossing\ny (M)")
            for ax, inclination in zip(row, INCLINATIONS, strict=True):
                panel(ax, inclination, crossing)
        for ax, inclination in zip(axes[0], INCLINATIONS, strict=True):
            ax.set_title(f"inclination {inclination:g} deg")
        for ax in axes[-1]:
            ax.set_xlabel("x, toward the camera (M)")
        shown = (ax.get_legend_handles_labels() for ax in axes.ravel())
        entries = {label: handle for handles, labels in shown for handle, label in zip(handles, labels, strict=True)}
        figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=len(entries))
        figure.suptitle(f"caustics in the equatorial plane: spin {SPIN}, radius {RADIUS:g}, fiducial observer")
    return write_line_art(figure, output, "disk_caustics")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
