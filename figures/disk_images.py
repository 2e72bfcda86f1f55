"""
A thin disk and its images
==========================

A disk of gas at 4500 K round a hole of spin 0.999 in front of the stars; the camera and the disk's radii are those of
the figure disk_swatches. The clouds of the gas are ours: they are random, trail behind its rotation, and let about half
of the light through, whereas the paper's disk has a texture of its own, which is not published. Remakes JTFT figure 14.
Colours and brightness are not shifted: what differs is how deep the gas is, how often a ray meets it, and where. Clouds
that are arcs on the disk are stretched over the hole where its far side is bent up, and seen again, from below, under
the shadow; the bottom face of the disk shines through its front.

The paper's: the spin, rims and camera, one temperature (following JTFT), a thin disk that is barely opaque, stars
behind it. Ours: the clouds, their mean depth of 0.8, and the stars of Hipparcos.
"""

import math
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw.scenes import save_picture

CAMERA = kc.Camera(spin=0.999, radius=74.1, inclination=math.radians(86.56), velocity="static")
VIEW = kc.pictures.View(1600, 900, math.radians(40))
# Rows and columns of the texture.
ROWS, COLUMNS = 512, 2048
# Of large clouds and of small ones: waves from rim to rim, and round, up to which all are equally strong.
CLOUDS = ((0.7, 5.0), (5.0, 20.0))
# Mean depth, spread of its logarithm, and by how far, in radians, the outer rim trails behind the inner one.
DEPTH, CONTRAST, TRAIL = 0.8, 1.4, 1.5
# Light of the sky, in stars of magnitude 0 per steradian, that becomes as white as a black body of 6504 K by itself.
WHITE = 4e4
NOTE = "After JTFT figure 14. The clouds of the gas are random, not the paper's texture."


def clouds(seed: int, across: float, around: float) -> np.ndarray:
    """A random field (ROWS, COLUMNS) of mean 0 and variance 1, outer rim first, periodic in azimuth."""
    waves = np.fft.rfft2(np.random.default_rng(seed).normal(size=(2 * ROWS, COLUMNS)))
    k, m = np.fft.fftfreq(2 * ROWS, 1 / ROWS)[:, None], np.arange(COLUMNS // 2 + 1)
    waves *= (1 + (k / across) ** 2 + (m / around) ** 2) ** -0.8
    rows = np.fft.ifft(waves, axis=0)[:ROWS] * np.exp(1j * m * TRAIL * np.linspace(0, 1, ROWS)[:, None])
    field = np.fft.irfft(rows, COLUMNS, axis=1)
    return (field - field.mean()) / field.std()


def gas() -> kc.disks.Texture:
    """Gas of one temperature: it emits the part of a black body's light that it absorbs."""
    across = (np.arange(ROWS) + 0.5)[:, None] / ROWS
    rim = np.clip(8 * np.minimum(across, 1 - across), 0, 1)
    field = sum(clouds(seed, *waves) for seed, waves in enumerate(CLOUDS)) / math.sqrt(len(CLOUDS))
    depth = DEPTH * rim**2 * (3 - 2 * rim) * np.exp(CONTRAST * field - CONTRAST**2 / 2)
    light = np.broadcast_to(kc.pictures.black_body(4500.0), (ROWS, COLUMNS, 3))
    return kc.disks.Texture(light, -np.expm1(-depth))


GAS = kc.disks.Disk(9.26, 18.70, gas(), slant=False, brightness=WHITE)


def main(output: Path) -> list[Path]:
    light = kc.render(CAMERA, VIEW, kc.skies.StarField(), disk=GAS).light
    save_picture(output / "disk_images.png", kc.pictures.tone_mapped(light, exposure=4.5 / WHITE), NOTE)
    return [output / "disk_images.png"]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
