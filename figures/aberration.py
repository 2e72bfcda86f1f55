"""
Aberration
==========

The paint swatches of the checkerboard's figure, seen by three cameras at one place, r = 2.6 on the equator of a hole
of spin 0.999: on a circular orbit; at rest with respect to the fiducial observer, which moves at 0.546 of the speed
of light backward as the circular camera sees it; and at rest in Boyer-Lindquist coordinates (static), at 0.813
backward. The red dot is the direction of the orbital motion, the black one its opposite. Remakes JTFT figure 12.

The paper's: hole, cameras, their velocities, the lensed swatches, the dots. Ours: the projection, longitude and
latitude of the whole sky about the direction of the hole (−e_r), which all three share; that red is forward and black
backward; the critical curves. All three see the same rays, so their pictures differ by aberration alone, which is
exact here: the faster a camera moves to the right, the more the sky crowds together there, and the smaller the
shadow, most of which lies on that side. It covers 0.45, 0.87 and 1.24 of half the sky. The caustics on the celestial
sphere are the same for all three.
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
from kerrcaustics.scenes.checkerboard import HUES

SPIN, RADIUS = 0.999, 2.6
SKY = kc.skies.Checkerboard(rows=15, columns=32, colours=HUES, along="longitude")
# Toward the hole, the spin axis up.
VIEW = kc.pictures.View(960, 480, 2 * math.pi, "equirectangular", forward=(-1, 0, 0), up=(0, 0, 1))
DOTS = {"red": (0.0, 1.0, 0.0), "black": (0.0, -1.0, 0.0)}


def main(output: Path) -> list[Path]:
    orbit = kc.Camera(SPIN, RADIUS).fido_velocity()[2]
    with rc_context(style.RC):
        figure = Figure(figsize=(5.2, 8.6), layout="constrained")
        for ax, velocity in zip(figure.subplots(3, 1), ("circular", "fiducial", "static"), strict=True):
            camera = kc.Camera(SPIN, RADIUS, velocity=velocity)
            own = camera.fido_velocity()[2]
            past = (own - orbit) / (1 - own * orbit)
            seen(ax, camera).set_title(velocity if past == 0 else f"{velocity}, {style.number(past, '.3f')} c")
        for ax in figure.axes[:2]:
            ax.set_xlabel("")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
        figure.suptitle(f"spin {SPIN}, radius {RADIUS}, inclination 90 deg\nvelocities past the circular camera")
    return [write_picture(figure, output / "aberration.png")]


def seen(ax: Axes, camera: kc.Camera) -> Axes:
    """The swatches as a camera sees them, critical curves, and the directions along its motion."""
    show_picture(ax, VIEW, kc.pictures.tone_mapped(kc.render(camera, VIEW, SKY).light, exposure=1.0))
    show_critical_curves(ax, VIEW, kc.caustics(camera, orders=3), linewidth=0.8)
    for (colour, direction), name in zip(DOTS.items(), ("forward", "backward"), strict=True):
        place = VIEW.pixels(np.array(direction))
        look = {"marker": "o", "markersize": 7, "color": colour, "markeredgecolor": "white", "linestyle": "none"}
        ax.plot(*place, label=name, scalex=False, scaley=False, **look)
    return ax


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
