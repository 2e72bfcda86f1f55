"""
A thin disk and its images
==========================

A disk of gas at 4500 K round a hole of spin 0.999 in front of the stars; the camera and the disk's radii are those of
the figure disk_swatches. The wisps of the gas are ours: they are random, and let about half of the light through,
whereas the paper's disk has a texture of its own, which is not published. Remakes JTFT figure 14. Colours and
brightness are not shifted: what differs is how deep the gas is, how often a ray meets it, and where. The bottom face of
the disk shines through its front.

The paper's: the spin, rims and camera, one temperature (following JTFT), a thin disk that is barely opaque, stars
behind it. Ours: the wisps, their depth of 0.8, and the stars of Hipparcos.
"""

import math
from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.scenes import save_picture

CAMERA = kc.Camera(spin=0.999, radius=74.1, inclination=math.radians(86.56), velocity="static")
VIEW = kc.pictures.View(1600, 900, math.radians(40))
GAS = kc.disks.Wisps(4500, inner=9.26, outer=18.70, depth=0.8, contrast=1.1)
# Light of the sky, in stars of magnitude 0 per steradian, that becomes as white as a black body of 6504 K by itself.
WHITE = 4e4
NOTE = "After JTFT figure 14. The wisps of the gas are random ones of kerrcaustics, not the paper's texture."


def main(output: Path) -> list[Path]:
    disk = kc.disks.Disk(GAS.inner, GAS.outer, GAS, opacity=GAS.opacity, slant=False, brightness=WHITE)
    light = kc.render(CAMERA, VIEW, kc.skies.StarField(), disk=disk).light
    save_picture(output / "disk_images.png", kc.pictures.tone_mapped(light, exposure=4.5 / WHITE), NOTE)
    return [output / "disk_images.png"]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
