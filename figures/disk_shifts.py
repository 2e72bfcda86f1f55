"""
A disk with its light shifted
=============================

A disk round a hole of spin 0.6: (a) with its light unchanged; (b) with its colours shifted, and their brightness kept;
(c) with both shifted, as a camera sees it. On the left the gas comes toward the camera: blue and bright; on the right
it goes away: red, and nearly as dark as the shadow. Numbers in (b) are the largest and the least ratio of frequencies,
camera to gas, over the first image, at the places where they are found. Remakes JTFT figures 15a to c.

The paper's: the spin, what is shifted in which picture, the camera, and the rims of the first disk (following JTFT).
The speed of 0.55 c and the factors of 1.5 and 0.4 that the paper states do not belong to gas on circular orbits within
these rims. They fit a disk whose inner edge is at r = 4.2 (the second picture), with its outer edge in proportion: the
gas is faster there, and its colours and brightness are those that the paper describes. Ours: that the camera is at
rest, the gas on circular geodesics, the wisps of the gas, a white balance in which its own 4500 K is white, a film each
of whose layers sees only red, green or blue, and the exposures.
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

CAMERA = kc.Camera(spin=0.6, radius=74.1, inclination=math.radians(86.56), velocity="static")
KELVIN = 4500.0
# Names of the pictures, rims, and the width of the view in degrees.
DISKS = {"disk_shifts": (9.26, 18.70, 32.5), "disk_shifts_closer": (4.2, 8.48, 25.0)}
WIDTH, HEIGHT = 1200, 530
# What is shifted, its switches, and what light becomes white.
ROWS = (
    ("(a) light unchanged", {}, 0.7),
    ("(b) colours shifted", {"colour_shift": True}, 1.0),
    ("(c) colours and brightness shifted", {"colour_shift": True, "beaming": True}, 1.1),
)


def main(output: Path) -> list[Path]:
    return [write_picture(drawn(*size), output / f"{name}.png") for name, size in DISKS.items()]


def drawn(inner: float, outer: float, width: float) -> Figure:
    """The disk between two radii, in a view so many degrees wide: its three pictures, one below the other."""
    disk, view = disk_of_gas(inner, outer), kc.pictures.View(WIDTH, HEIGHT, math.radians(width))
    traced = kc.pictures.trace_view(CAMERA, view, sky=False, disk=disk)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 10.1), layout="constrained")
        axes = figure.subplots(3, 1)
        for ax, (title, shifts, white) in zip(axes, ROWS, strict=True):
            light = traced.show(disk=disk, **shifts).light / kc.pictures.black_body(KELVIN, response="film")
            ax.imshow(kc.pictures.tone_mapped(light, exposure=1 / white))
            ax.set_axis_off()
            ax.set_title(title)
        name_extremes(axes[1], view, disk)
        place = f"radius {CAMERA.radius}, inclination {math.degrees(CAMERA.inclination):.2f} deg, static"
        figure.suptitle(f"disk from r = {inner} to {outer} M; spin {CAMERA.spin}, {place}")
    return figure


def disk_of_gas(inner: float, outer: float) -> kc.disks.Disk:
    gas = kc.disks.Wisps(KELVIN, inner=inner, outer=outer, depth=0.8, contrast=1.1, response="film")
    return kc.disks.Disk(inner, outer, gas, opacity=gas.opacity, slant=False)


def name_extremes(ax: Axes, view: kc.pictures.View, disk: kc.disks.Disk) -> None:
    """The least and the largest ratio of frequencies over the first image of a disk: they lie on its rims."""
    rims = kc.isoradials(CAMERA, [disk.inner, disk.outer], crossings=1, points=720)
    sky, ratio = (np.concatenate([getattr(rim, name) for rim in rims]) for name in ("sky", "redshift"))
    for number in (ratio.argmin(), ratio.argmax()):
        place = view.pixels(sky[number])
        side = 1 if place[0] > view.width / 2 else -1
        arrow = {"arrowstyle": "-", "color": "white", "linewidth": 0.8, "shrinkB": 2}
        text = {"color": "white", "fontsize": 11, "ha": "center", "va": "center", "arrowprops": arrow}
        ax.annotate(f"{ratio[number]:.2f}", place, place + np.array([side * 50, 130]), **text)


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
