"""
A disk with its light shifted
=============================

Two disks round a hole of spin 0.6: with their light unchanged; with their colours shifted, and their brightness kept;
with both shifted, as a camera sees them. On the left the gas comes toward the camera: blue and bright; on the right it
goes away: red, and nearly as dark as the shadow. Remakes JTFT figures 15a to c.

The paper's: the spin, what is shifted in which picture, the camera, and the rims in the left column (following JTFT).
The speed of 0.55 c and the factors of 1.5 and 0.4 that the paper states do not belong to gas on circular orbits within
these rims. They fit a disk whose inner edge is at r = 4.2 (right column), with its outer edge in proportion: the gas is
faster there, and its colours and brightness are those that the paper describes. Ours: that the camera is at rest, the
gas on circular geodesics, the wisps of the gas, a white balance in which its own 4500 K is white, a film each of whose
layers sees only red, green or blue, and the exposures. The numbers in the titles are the extremes of the frequency
ratio over the first image.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture

CAMERA = kc.Camera(spin=0.6, radius=74.1, inclination=math.radians(86.56), velocity="static")
KELVIN = 4500.0
# Rims, and the width of the view in degrees.
DISKS = ((9.26, 18.70, 40), (4.2, 8.48, 30))
# What is shifted, its switches, and what light becomes white.
ROWS = (
    ("light unchanged", {}, 0.7),
    ("colours shifted", {"colour_shift": True}, 1.0),
    ("colours and brightness shifted", {"colour_shift": True, "beaming": True}, 0.9),
)


def main(output: Path) -> list[Path]:
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.6), layout="constrained")
        for column, (inner, outer, width) in zip(figure.subplots(3, 2).T, DISKS, strict=True):
            disk, view = disk_of_gas(inner, outer), kc.pictures.View(1000, 450, math.radians(width))
            traced = kc.pictures.trace_view(CAMERA, view, sky=False, disk=disk)
            for ax, (title, shifts, white) in zip(column, ROWS, strict=True):
                light = traced.show(disk=disk, **shifts).light / kc.pictures.black_body(KELVIN, response="film")
                ax.imshow(kc.pictures.tone_mapped(light, exposure=1 / white))
                ax.set_axis_off()
                ax.set_title(title)
            least, most = extremes(disk)
            column[0].set_title(f"r = {inner} to {outer} M, ratios {least:.2f} to {most:.2f}\n{ROWS[0][0]}")
        place = f"radius {CAMERA.radius}, inclination {math.degrees(CAMERA.inclination):.2f} deg, static"
        figure.suptitle(f"spin {CAMERA.spin}, {place}")
    return [write_picture(figure, output / "disk_shifts.png")]


def disk_of_gas(inner: float, outer: float) -> kc.disks.Disk:
    gas = kc.disks.Wisps(KELVIN, inner=inner, outer=outer, depth=0.8, contrast=1.1, response="film")
    return kc.disks.Disk(inner, outer, gas, opacity=gas.opacity, slant=False)


def extremes(disk: kc.disks.Disk) -> tuple[float, float]:
    """Least and largest ratio of frequencies, camera to gas, over the first image of a disk: they lie on its rims."""
    rims = kc.isoradials(CAMERA, [disk.inner, disk.outer], crossings=1, points=720)
    ratio = np.concatenate([rim.redshift for rim in rims])
    return ratio.min(), ratio.max()


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
