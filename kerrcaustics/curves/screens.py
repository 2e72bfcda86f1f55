"""What users see of directions on the sky that is searched: the moving camera's own, or places on a screen.

The sky that is searched is that of a camera at rest. Where the hole is tiny on it, an observer at the same place stands
in, whose sky is magnified about the hole.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kerrcaustics.beams.beam import Beams
from kerrcaustics.spacetime.camera import Camera, Frame, doppler, looking_from_sky, sky_from_looking
from kerrcaustics.spacetime.observer import Observer, on_screen, screen_basis

Array = np.ndarray

# Radius from which on an observer stands in for cameras.
_FAR = 1e5
# Of a direction that is moved from one sky to another.
_ROUNDING = 4e-16


@dataclass(frozen=True)
class SeenLight:
    """Light on the sky of a camera: directions N or places, beams, magnification and redshift as the camera has them.

    The beams belong to who searches for the camera if that is an observer, else to the camera; places and times of
    their ends are the camera's too. spread: major diameters of beams of unit size on the sky that is searched.
    """

    sky: Float[Array, "n axes"]
    beams: Beams
    magnification: Float[Array, " n"]
    redshift: Float[Array, " n"]
    spread: Float[Array, " n"]


def searcher(camera: Camera) -> Camera:
    """Who searches the sky for a camera, at rest at the same event."""
    if camera.is_distant or camera.radius < _FAR:
        return camera.at_rest()
    return Observer(camera.spin, camera.inclination, camera.radius)


def as_seen(sky: np.ndarray, one: Frame, other: Frame) -> np.ndarray:
    """The directions N (..., 3) on the sky of one camera, as the other one sees them: cameras at the same event."""
    looking = looking_from_sky(one, sky)
    return sky_from_looking(other, looking if one.zoom == other.zoom else _zoomed_by(one.zoom / other.zoom, looking))


def _zoomed_by(zoom: float, looking: np.ndarray) -> np.ndarray:
    """Directions (..., 3) of the FIDO, tangents of half the angle from that to the hole being multiplied by zoom."""
    inward = -looking[..., :1]
    across = (looking[..., 1:] ** 2).sum(axis=-1, keepdims=True)
    # 1 + cos and 1 - cos of the angle, of which one is small.
    near, far = np.where(inward > 0, 1 + inward, 0), np.where(inward > 0, 0, 1 - inward)
    with np.errstate(divide="ignore", invalid="ignore"):
        near, far = np.where(inward > 0, near, across / far), np.where(inward > 0, across / near, far)
    size = near + zoom**2 * far
    return np.concatenate([(zoom**2 * far - near) / size, 2 * zoom * looking[..., 1:] / size], axis=-1)


def shown(camera: Camera, sky: Float[Array, "n 3"]) -> Float[Array, "n axes"]:
    """Directions N on the sky that is searched, as the camera sees them; of an Observer the places (alpha, beta)."""
    return on_screen(sky) if camera.is_distant else as_seen(sky, searcher(camera).frame(), camera.frame())


def shown_looking(camera: Camera, looking: Float[Array, "n 3"]) -> Float[Array, "n axes"]:
    """The same of directions of the FIDO on the sky that is searched."""
    return shown(camera, sky_from_looking(searcher(camera).frame(), looking))


def lengths(camera: Camera, sky: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """By how much a radian on the sky that is searched is longer for users, with aberration; in M on a screen."""
    return still_lengths(camera, sky) * stretch(camera, shown(camera, sky))


def still_lengths(camera: Camera, sky: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """The same for a camera at rest."""
    if not searcher(camera).is_distant:
        return np.ones(len(sky))
    size = 1 / np.linalg.norm(screen_basis(sky)[0], axis=-1)
    return size if camera.is_distant else radians_of(camera.radius, sky, size)


def stretch(camera: Camera, place: Float[Array, "n axes"]) -> Float[Array, " n"]:
    """By how much aberration makes lengths on the sky longer, at directions of the moving camera; 1 on a screen.

    It maps the sky of the camera at rest without distortion, and shrinks what it shifts to the blue.
    """
    if camera.is_distant:
        return np.ones(len(place))
    frame = camera.frame()
    return doppler(frame, tuple(place.T))[0] / frame.slowness**0.5


def errors(camera: Camera, sky: Float[Array, "n 3"], error: Float[Array, " n"]) -> Float[Array, " n"]:
    """Errors of directions on the sky that is searched, radians, as users have them; of an Observer in M.

    With aberration comes the rounding of both directions, which may be more where it shrinks the error.
    """
    grown = error * lengths(camera, sky)
    if camera.is_distant or camera.frame().speed == 0:
        return grown
    return grown + _ROUNDING * (1 + stretch(camera, shown(camera, sky)))


def radians_of(radius: float, sky: Float[Array, "n 3"], size: Float[Array, " n"]) -> Float[Array, " n"]:
    """Lengths (M) beside places of a screen at some radius, as angles."""
    # A direction at the angle psi has the length 2 r tan(psi / 2).
    part = np.linalg.norm(on_screen(sky), axis=-1) / (2 * radius)
    return size / (radius * (1 + part**2))


def seen(camera: Camera, sky: Float[Array, "n 3"], traced: Callable[[Camera, Array], Beams]) -> SeenLight:
    """Directions on the sky that is searched, as the camera has them; traced: beams of a camera, with redshift."""
    lens, place = searcher(camera), shown(camera, sky)
    size = stretch(camera, place)
    if not lens.is_distant:
        beams = traced(camera, place)
        return SeenLight(place, beams, beams.magnification, np.asarray(beams.redshift), beams.delta_plus * size)
    beams = traced(lens, sky)
    magnification = beams.magnification * (still_lengths(camera, sky) * size) ** 2
    return SeenLight(place, beams, magnification, np.asarray(beams.redshift) / size, beams.delta_plus)


def clock(
    camera: Camera, time: Float[Array, " n"] | None, error: Float[Array, " n"] | None
) -> tuple[Float[Array, " n"] | None, Float[Array, " n"] | None]:
    """Times to who searches and their errors, as times to the camera."""
    if time is None or error is None or camera.is_distant or not searcher(camera).is_distant:
        return time, error
    start = camera.frame().start
    return time + start, error + np.spacing(start)


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
