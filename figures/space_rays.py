"""Rays round the hole
===================

Rays of a camera at r = 6.03 M that arrive from close to the shadow, in the equatorial plane and in a plane tilted
relative to it, coloured by their Morse index: how many conjugate points each has passed on its way from the sky. Rays
in the directions of the shadow, which come from no star, are grey, and end just above the horizon; the others are
followed to a sphere of r = 12 M, where they are marked.

Writes a picture (PNG), a model (glTF) and a page on which the model can be rotated with the mouse (HTML).
"""

import math
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw.solids import rays_model
from kerrcaustics.draw.space import write_model

# Degrees from the direction of the hole, in the equatorial plane and in the tilted one.
EQUATORIAL = (-52, -40, -29, -18, -9, 0, 6, 20, 40)
TILTED = (-50, -30, 22, 34, 50)


def main(output: Path) -> list[Path]:
    """The files, made in an existing folder."""
    camera = kc.Camera(spin=0.999, radius=6.03)
    sky = np.concatenate([fan(0.0, EQUATORIAL), fan(math.radians(70), TILTED)])
    paths = kc.ray_paths(camera, sky, 600)
    return write_model(rays_model(camera, paths), output, "space_rays")


def fan(tilt: float, across: tuple[float, ...]) -> np.ndarray:
    """Directions in a plane through the hole's direction, tilted by an angle, at degrees from that direction."""
    angle = np.radians(across)
    return np.stack([-np.cos(angle), np.sin(angle) * math.cos(tilt), np.sin(angle) * math.sin(tilt)], axis=-1)


if __name__ == "__main__":
    folder = Path(__file__).parent / "out"
    folder.mkdir(exist_ok=True)
    main(folder)
