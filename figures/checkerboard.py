"""
A checkerboard sky at r = 2.6
=============================

The celestial sphere of paint swatches (JTFT fig 10), and what a camera on a circular orbit at r = 2.6 round a hole of
spin 0.999 sees of it: the whole front of its sky, and the flat left edge of the shadow with three critical curves. On
each critical curve the footprint of a beam shrinks to a line, so that swatches are stretched without bound; across it
their image is mirrored.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.files import write_picture
from kerrcaustics.draw.scenes import show_critical_curves, show_picture

CAMERA = kc.Camera(spin=0.999, radius=2.6)
SKY = kc.Checkerboard()


def flat_edge(width: int, height: int, field: float) -> kc.View:
    """The view of a field (radians) that has the prograde end of the shadow edge two thirds to the right."""
    middle = kc.View.toward_hole(CAMERA, width, height, field)
    left = kc.shadow_edge(CAMERA, 4)[0]
    outward = np.cross(np.cross(left, middle.forward), left)
    away = -field / 6
    forward = left * math.cos(away) + outward / np.linalg.norm(outward) * math.sin(away)
    return kc.View(width, height, field, forward=forward, up=middle.up)


def celestial_panel(ax: Axes) -> None:
    light = kc.celestial_picture(SKY, 400)
    ax.imshow(kc.tone_mapped(light), extent=(0, 360, 180, 0))
    ax.set_xticks(range(0, 361, 90))
    ax.set_yticks(range(0, 181, 45))
    ax.set_xlabel("φ′ (deg)")
    ax.set_ylabel("θ′ (deg)")
    ax.set_title("celestial sphere")


def seen(ax: Axes, view: kc.View, caustics: kc.CausticSet) -> Axes:
    show_picture(ax, view, kc.tone_mapped(kc.render(CAMERA, view, SKY).light))
    return show_critical_curves(ax, view, caustics)


def main(output: Path) -> list[Path]:
    caustics = kc.caustics(CAMERA, orders=3)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.3), layout="constrained")
        grid = figure.add_gridspec(2, 2, width_ratios=[1.35, 1.0], height_ratios=[1, 1.6])
        whole = kc.View.toward_hole(CAMERA, 1000, 1200, math.radians(190), "fisheye")
        seen(figure.add_subplot(grid[:, 0]), whole, caustics).set_title("camera sky")
        celestial_panel(figure.add_subplot(grid[0, 1]))
        near = seen(figure.add_subplot(grid[1, 1]), flat_edge(800, 800, math.radians(50)), caustics)
        near.set_title("left edge of the shadow")
        figure.legend(*near.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return [write_picture(figure, output / "checkerboard.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
