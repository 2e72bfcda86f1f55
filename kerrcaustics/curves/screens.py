"""What users see of directions on the sky of a camera at rest: the moving camera's own, or places on a screen."""

import numpy as np
from jaxtyping import Float

from kerrcaustics.spacetime.camera import Camera, Frame, as_seen, sky_from_looking
from kerrcaustics.spacetime.observer import from_screen, on_screen, screen_basis

Array = np.ndarray


def shown(camera: Camera, sky: Float[Array, "n 3"]) -> Float[Array, "n axes"]:
    """Directions N on the sky at rest, as the camera sees them; of an Observer the places (alpha, beta)."""
    return on_screen(sky) if camera.is_distant else as_seen(sky, camera.at_rest().frame(), camera.frame())


def unshown(camera: Camera, sky: Float[Array, "n axes"]) -> Float[Array, "n 3"]:
    """The inverse of `shown`."""
    return from_screen(sky) if camera.is_distant else as_seen(sky, camera.frame(), camera.at_rest().frame())


def shown_looking(camera: Camera, looking: Float[Array, "n 3"]) -> Float[Array, "n axes"]:
    """The same of directions of the FIDO."""
    sky = sky_from_looking(camera.frame(), looking)
    return on_screen(sky) if camera.is_distant else sky


def lengths(camera: Camera, sky: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """By how much a radian on the sky at rest is longer for users: M on an Observer's screen, else 1."""
    return 1 / np.linalg.norm(screen_basis(sky)[0], axis=-1) if camera.is_distant else np.ones(len(sky))


def magnified(frame: Frame, motion: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Directions of photons (r, theta, phi), which move outward, on the sky as an observer's engines take it.

    The inverse of `zoomed`, for others the directions themselves. Tangents of half the angle from the direction to the
    hole are divided by the zoom.
    """
    if frame.zoom == 1:
        return motion
    across = motion[:, 1:] / (frame.zoom * (1 + motion[:, :1]))
    square = (across * across).sum(axis=1, keepdims=True)
    return np.concatenate([1 - square, 2 * across], axis=1) / (1 + square)
