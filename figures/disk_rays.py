"""Rays that end on a disk
=======================

Rays of a camera at r = 16 M, 10 degrees above an opaque disk from r = 4 to r = 10, in the plane through the
camera and the spin axis: those that reach the disk where they first cross its plane, having passed over the hole or in
front of it; those that miss it there and reach it from below at the second crossing; and those that go all the way
round the hole and end on its top face at the third. Of each image of the disk the rays to its rims and to its middle
are drawn; crosses mark where they end.

Writes a picture (PNG), a model (glTF) and a page on which the model can be rotated with the mouse (HTML).
"""

import math
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw.solids import disk_rays_model
from kerrcaustics.draw.space import write_model

CAMERA = kc.Camera(spin=0.6, radius=16, inclination=math.radians(80), velocity="static")
INNER, OUTER = 4.0, 10.0
# Rays that are tried in each plane, and that are drawn of each image of the disk in it.
TRIED, DRAWN = 6000, 3


def fan() -> np.ndarray:
    """Directions (TRIED, 3) in the plane through the spin axis."""
    across = np.radians(np.linspace(-60, 60, TRIED))
    return np.stack([-np.cos(across), np.zeros(TRIED), np.sin(across)], axis=-1)


def crossing_at_disk(sky: np.ndarray) -> np.ndarray:
    """At which crossing (n,) rays first meet the disk: 1, 2, 3, or 0 for none of these."""
    found = np.zeros(len(sky), int)
    for crossing in (3, 2, 1):
        radius = kc.trace_rays(CAMERA, sky, end=kc.EquatorialPlane(crossing)).radius
        found[(radius >= INNER) & (radius <= OUTER)] = crossing
    return found


def some(found: np.ndarray) -> np.ndarray:
    """Numbers of a few rays of each image, evenly spaced."""
    edges = np.flatnonzero(np.diff(found)) + 1
    images = [image for image in np.split(np.arange(len(found)), edges) if found[image[0]]]
    return np.concatenate([image[np.linspace(0, len(image) - 1, DRAWN).astype(int)] for image in images])


def main(output: Path) -> list[Path]:
    """The files, made in an existing folder."""
    sky = fan()
    found = crossing_at_disk(sky)
    drawn = some(found)
    paths = kc.ray_paths(CAMERA, sky[drawn], 800)
    return write_model(disk_rays_model(CAMERA, paths, found[drawn], (INNER, OUTER)), output, "disk_rays")


if __name__ == "__main__":
    folder = Path(__file__).parent / "out"
    folder.mkdir(exist_ok=True)
    main(folder)
