"""
A disk with and without the hole
================================

The same camera, stars and disk twice: in flat space, and round a hole of spin 0.6. The camera is at rest at r = 70, 3.9
degrees above the plane of the disk, which reaches from r = 4 to r = 10; the stars are at r = 80. With the hole, the far
side of the disk stands up over the shadow, its underside shows below, and the stars are displaced.
"""

import math
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.draw.scenes import show_picture
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.scenes.disk.flat import render_flat

CAMERA = kc.Camera(spin=0.6, radius=70, inclination=math.radians(90 - 180 / 46), velocity="static")
VIEW = kc.pictures.View(936, 432, math.radians(39))
SKY = kc.skies.StarField()
# White paint is somewhat darker than what the exposure of the stars makes white.
EXPOSURE = 1 / 8_000
SKY_RADIUS = 80
DISK = kc.disks.Disk(inner=4, outer=10, emission=kc.disks.Swatches(rows=4, columns=36), brightness=0.35 / EXPOSURE)


def main(output: Path) -> list[Path]:
    lights = {
        "without the hole": render_flat(CAMERA, VIEW, SKY, disk=DISK, sky_radius=SKY_RADIUS),
        "with the hole": kc.render(CAMERA, VIEW, SKY, disk=DISK, sky_radius=SKY_RADIUS).light,
    }
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.9), layout="constrained")
        for ax, (name, light) in zip(figure.subplots(2, 1), lights.items(), strict=True):
            show_picture(ax, VIEW, kc.pictures.tone_mapped(light, EXPOSURE, curve="asinh", softening=20))
            ax.set_title(name)
        about = f"disk from r = {DISK.inner:g} to {DISK.outer:g} M, stars at r = {SKY_RADIUS} M"
        figure.suptitle(f"{viewer_in_words(CAMERA)}; {about}")
    return [write_picture(figure, output / "disk_side_by_side.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
