"""
A star field at r = 2.6
=======================

The stars of the Hipparcos-2 catalogue and a galactic band, seen from a circular orbit at r = 2.6 round a hole of spin
0.999: (a) the camera sky with the first three critical curves, and (b) the flat left edge of the shadow, without and
with them; degrees are measured from the middle of the shadow in all three pictures. Stars near a critical curve are
bright, and as small as anywhere else. Remakes JTFT figure 8.

The paper's: hole, camera, the critical curves, the enlarged edge, the galactic plane. Ours: 37,622 stars of Hipparcos
in place of the 2.5 million brightest of Tycho-2, which are not ours to ship (docs/scenes.md says how to add some), and
a smooth model of the galactic band.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.draw.scenes import show_critical_curves, show_picture
from kerrcaustics.draw.titles import headline

CAMERA = kc.Camera(spin=0.999, radius=2.6)
SKY = kc.skies.StarField()


def flat_edge(width: int, height: int, field: float) -> kc.pictures.View:
    """The view of a field (radians) that has the prograde end of the shadow edge three quarters to the right."""
    middle = kc.pictures.View.toward_hole(CAMERA, width, height, field)
    left = kc.shadow_edge(CAMERA, 4)[0]
    inward = np.cross(np.cross(left, middle.forward), left)
    away = field / 4
    forward = left * math.cos(away) - inward / np.linalg.norm(inward) * math.sin(away)
    return kc.pictures.View(width, height, field, forward=forward, up=middle.up)


def seen(ax: Axes, view: kc.pictures.View, picture: np.ndarray, whole: kc.pictures.View | None = None) -> Axes:
    show_picture(ax, view, picture, whole, "shadow's middle")
    ax.set_facecolor("black")
    return ax


def picture_of(view: kc.pictures.View) -> np.ndarray:
    light = kc.render(CAMERA, view, SKY).light
    # One exposure for what one star gives a pixel: the sky's own light then looks alike in all panels.
    return kc.pictures.tone_mapped(light, exposure=1 / 2500, curve="asinh", softening=25)


def main(output: Path) -> list[Path]:
    caustics = kc.caustics(CAMERA, orders=3)
    whole = kc.pictures.View.toward_hole(CAMERA, 640, 500, math.radians(232), "fisheye")
    near = flat_edge(360, 360, math.radians(24))
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 8.8), layout="constrained")
        grid = figure.add_gridspec(2, 2, height_ratios=[1.6, 1])
        sky = seen(figure.add_subplot(grid[0, :]), whole, picture_of(whole))
        show_critical_curves(sky, whole, caustics, on_black=True, linewidth=0.9, path_effects=[])
        sky.set_title("(a) camera sky")
        picture = picture_of(near)
        plain = seen(figure.add_subplot(grid[1, 0]), near, picture, whole)
        plain.set_title("(b) left edge of the shadow")
        lined = seen(figure.add_subplot(grid[1, 1]), near, picture, whole)
        show_critical_curves(lined, near, caustics, on_black=True, linewidth=0.9, path_effects=[])
        lined.set_title("with critical curves")
        look = {"facecolor": "black", "labelcolor": "white", "frameon": True}
        figure.legend(*sky.get_legend_handles_labels(), loc="outside lower center", ncols=3, **look)
        figure.suptitle(headline(caustics))
    return [write_picture(figure, output / "star_field.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
