"""
A disk of paint swatches
========================

A thin disk round a hole of spin 0.999, seen from r = 74.1, inclination 86.56 degrees, almost edge-on; at the top left,
the same disk from above, with no hole. Remakes JTFT figure 13. The first image is that of the top face, a closed ring:
it goes round the front, and its far side is bent up over the shadow. The second image is that of the bottom face, wide
below the shadow and thin above it. The third, of the top face again, is a thin line along the lower edge of the shadow;
above, it is too thin to be seen next to the second. The left edge of the shadow, where light moves with the hole's
rotation, is flat, and the shadow lies to the right of the disk's middle. Colours and brightness are not shifted.

The paper's: the spin, rims and camera (following JTFT), equally spaced swatches, the inset, unchanged light. Ours:
the colours and the number of the swatches, and that the camera is at rest.
"""

import math
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw.scenes import save_picture
from kerrcaustics.scenes.disk.samples import DiskSamples

CAMERA = kc.Camera(spin=0.999, radius=74.1, inclination=math.radians(86.56), velocity="static")
VIEW = kc.pictures.View(1920, 1080, math.radians(40))
DISK = kc.disks.Disk(inner=9.26, outer=18.70, emission=kc.disks.Swatches())
INSET, MARGIN = 380, 30
# Rays in each direction of a pixel of the inset.
RAYS = 4


def from_above(size: int) -> np.ndarray:
    """Light (size, size, 3) of the disk in flat space, face-on: the camera's side below, phi counter-clockwise."""
    rays = size * RAYS
    step = 2.05 * DISK.outer / rays
    x, y = np.meshgrid(*2 * [(np.arange(rays) + 0.5 - rays / 2) * step])
    radius, azimuth = np.hypot(x, y).ravel(), np.arctan2(x, y).ravel()
    width = DISK.outer - DISK.inner
    matrix = np.tile(step * np.eye(2), (len(radius), 1, 1))
    across, still = (radius - DISK.inner) / width, (np.zeros_like(radius), np.zeros_like)
    samples = DiskSamples(radius, azimuth, across, matrix, np.ones_like(radius), width, 0.0, *still)
    light = DISK.emission.light(samples, beaming=False, colour_shift=False)
    light[(across < 0) | (across > 1)] = 0
    return light.reshape(size, RAYS, size, RAYS, 3).mean(axis=(1, 3))


def main(output: Path) -> list[Path]:
    light = kc.render(CAMERA, VIEW, disk=DISK).light
    light[MARGIN : MARGIN + INSET, MARGIN : MARGIN + INSET] = from_above(INSET)
    save_picture(output / "disk_swatches.png", kc.pictures.tone_mapped(light, exposure=1.0))
    return [output / "disk_swatches.png"]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
