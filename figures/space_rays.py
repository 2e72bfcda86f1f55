"""Rays round the hole
===================

Rays of a camera at r = 6.03 M that arrive from close to the shadow, in the equatorial plane and in a plane tilted
relative to it, coloured by their Morse index: how many conjugate points each has passed on its way from the sky. Rays
in the directions of the shadow, which come from no star, are grey, and end just above the horizon.

Writes a picture (PNG), a model (glTF) and a page on which the model can be rotated with the mouse (HTML).
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw.solids import rays_model
from kerrcaustics.draw.space import write_model


def main(output: Path) -> list[Path]:
    """The files, made in an existing folder."""
    camera = kc.Camera(spin=0.999, radius=6.03)
    across = np.radians(np.linspace(-56, 56, 29))
    fans = [
        np.stack([-np.cos(across), np.sin(across) * np.cos(tilt), np.sin(across) * np.sin(tilt)], axis=-1)
        for tilt in np.radians([0.0, 70.0])
    ]
    sky = np.concatenate(fans)
    paths = kc.ray_paths(camera, sky, 600)
    model = rays_model(camera, paths)
    # From a little farther away, so that no ray runs behind the key.
    return write_model(replace(model, extent=1.15 * model.extent), output, "space_rays")


if __name__ == "__main__":
    folder = Path(__file__).parent / "out"
    folder.mkdir(exist_ok=True)
    main(folder)
