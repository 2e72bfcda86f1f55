"""Rays of an observer's screen, as other programs give them: by alpha to the right and beta up, in units of M."""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime.frame import photon_of, redshift, sky_from_fido
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


def observer(spin: float, inclination_deg: float, radius: float = 1e6) -> kc.Camera:
    """A camera at rest with respect to the FIDO."""
    return kc.Camera(spin, radius, math.radians(inclination_deg), "fiducial")


def constants(camera: Viewer, alpha: Array, beta: Array) -> tuple[Array, Array]:
    """b and q of the photons that an observer at infinity would see there."""
    sine, cosine, a = camera.sin_theta, camera.cos_theta, camera.spin
    return -alpha * sine, (alpha**2 - a * a) * cosine**2 + beta**2


def arriving(camera: kc.Camera, b: Array, q: Array, r_sign: Array, theta_sign: Array) -> Array:
    """Directions N (n, 3) of photons with constants b and q, whose p_r and p_theta at a fiducial camera have signs."""
    frame = camera.frame()
    sine, cosine, a = camera.sin_theta, camera.cos_theta, camera.spin
    energy = (1 - frame.shift * b) / frame.lapse
    along_phi = b / (frame.cylindrical_scale * sine * energy)
    square = q + (a * cosine) ** 2 - (b * cosine / sine) ** 2
    along_theta = theta_sign * np.sqrt(np.maximum(square, 0)) / (frame.root_sigma * energy)
    along_r = r_sign * np.sqrt(np.maximum(1 - along_phi**2 - along_theta**2, 0))
    return sky_from_fido(frame, np.stack([along_r, along_theta, along_phi], axis=-1))


def directions(camera: kc.Camera, alpha: Array, beta: Array) -> Array:
    """Directions N (n, 3) of places on the screen: the photon moves outward, and down where it comes from above."""
    b, q = constants(camera, alpha, beta)
    return arriving(camera, b, q, np.ones_like(b), np.where(beta < 0, -1.0, 1.0))


def shift_to_infinity(camera: kc.Camera, sky: Array) -> Array:
    """nu_infinity / nu_camera (n,) of light from directions (n, 3), which an observer at infinity would see."""
    return 1 / redshift(camera.frame(), sky)


def momenta(camera: kc.Camera, sky: Array) -> tuple[Array, Array]:
    """b and q (n,) of light from directions (n, 3)."""
    light = photon_of(camera.frame(), tuple(sky.T))
    return light.b, light.q


def directions_of_impact(camera: kc.Camera, b: Array, turn: Array) -> Array:
    """Directions N (n, 3) of rays with impact parameters b at spin 0, at turns from right (+phi) to up."""
    sine = b * math.sqrt(1 - 2 / camera.radius) / camera.radius
    return np.stack([-np.sqrt(1 - sine**2), sine * np.cos(turn), sine * np.sin(turn)], axis=-1)
