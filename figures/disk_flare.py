"""
A disk seen through a lens with flare
=====================================

The disk round a hole of spin 0.6 through the lens of a camera. Remakes JTFT figure 16. Colours and brightness are not
shifted. The lens keeps most of the light in place and scatters the rest over the picture, in a narrow halo and in a
wide one: the shadow is no longer black.

The paper's: the disk of figure 15a seen through a lens with veiling flare. Ours: how the lens scatters light.
"""

import math
from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.scenes import save_picture

CAMERA = kc.Camera(spin=0.6, radius=74.1, inclination=math.radians(86.56), velocity="static")
VIEW = kc.pictures.View(1600, 900, math.radians(40))
GAS = kc.disks.Wisps(4500, inner=9.26, outer=18.70, depth=0.8, contrast=1.1)


def main(output: Path) -> list[Path]:
    disk = kc.disks.Disk(GAS.inner, GAS.outer, GAS, opacity=GAS.opacity, slant=False)
    light = kc.render(CAMERA, VIEW, disk=disk).light
    # Two lenses, one after the other.
    for share, width in ((0.25, 4), (0.25, 60)):
        light = kc.pictures.with_glare(light, kc.pictures.glare_kernel(share, width))
    save_picture(output / "disk_flare.png", kc.pictures.tone_mapped(light, exposure=7))
    return [output / "disk_flare.png"]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
