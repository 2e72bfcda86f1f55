"""The frame of a viewer: directions on its sky, in the frame of the FIDO there, and the photon behind each of them."""

import math
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.spacetime.sphere import unit

# Speed above which sums with it are written so that they do not cancel.
_FAST = 0.5


class Frame(NamedTuple):
    """The numbers of a camera that rays need, as a tree of floats that can go into compiled code.

    spin: spin of the hole.
    radius: radius of the camera.
    sin_theta: sine of its polar angle.
    cos_theta: cosine of its polar angle.
    lapse: alpha, the FIDO's proper time per coordinate time at the camera.
    shift: omega, the FIDO's angular velocity at the camera.
    cylindrical_scale: root of g_phiphi over sin(theta) at the camera, times `zoom`.
    root_sigma: root of Sigma at the camera.
    root_sigma_delta: root of Sigma Delta at the camera.
    speed: the camera's speed beta measured by the FIDO, along e_y.
    slowness: 1 - beta^2.
    basis: camera basis, rows e_x, e_y, e_z, in FIDO components (r, theta, phi).
    zoom: magnification of the sky about the direction to the hole, below 1 for an `Observer`: see `zoomed`.
    start: r + 2 ln r, the origin of the time to the camera, 0 for an `Observer`.
    """

    spin: float
    radius: float
    sin_theta: float
    cos_theta: float
    lapse: float
    shift: float
    cylindrical_scale: float
    root_sigma: float
    root_sigma_delta: float
    speed: float
    slowness: float
    basis: tuple[tuple[float, float, float], ...]
    zoom: Any
    start: Any


class Photon(NamedTuple):
    """Constants and first values of a photon of unit energy at infinity, followed backward in Mino time.

    b: axial angular momentum.
    k: q + b^2.
    kappa: q + (b - a)^2.
    q: Carter constant.
    position: u = 1/r and m = (x, y, z), the unit vector that carries theta and the smooth part of phi.
    rate: rates of the position.
    energy_ratio: E_infinity / E_FIDO; at or below zero there is no such photon from infinity.
    """

    b: Any
    k: Any
    kappa: Any
    q: Any
    position: tuple[Any, Any, Any, Any]
    rate: tuple[Any, Any, Any, Any]
    energy_ratio: Any


def potential_coefficients(spin: Any, photon: Photon) -> tuple[Any, Any, Any]:
    """(a2, a1, a0) of R(r) = r^4 + a2 r^2 + a1 r + a0 (JTFT A.1 with E = 1)."""
    return spin**2 - photon.k, 2 * photon.kappa, -(spin**2) * photon.q


def fido_from_sky(frame: Frame, sky: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """Direction of motion (n_r, n_theta, n_phi) of the photon seen in camera-sky direction N (JTFT A.1).

    sky holds the components N_x, N_y, N_z, floats or arrays.
    """
    x, _, z = sky
    boost, aberration = doppler(frame, sky)
    shrink = -(frame.slowness**0.5)
    along = (shrink * x / boost, aberration / boost, shrink * z / boost)
    r, theta, phi = (sum(along[i] * frame.basis[i][j] for i in range(3)) for j in range(3))
    return r, theta, phi


def doppler(frame: Frame, sky: tuple[Any, Any, Any]) -> tuple[Any, Any]:
    """1 - beta y and beta - y, which do not cancel where a camera close to the speed of light looks along its motion.

    Floats, NumPy or JAX arrays: a truth value as a factor chooses between two forms.
    """
    x, y, z = sky
    beta = frame.speed
    sense = 2 * (beta >= 0) - 1
    toward, beta_size = sense * y, sense * beta
    ahead = toward > 0
    # 1 - |y|, and 1 - |beta|.
    near = ahead * (x * x + z * z) / (1 + ahead * toward) + (1 - ahead) * (1 - toward)
    slow = frame.slowness / (1 + beta_size)
    fast = beta_size > _FAST
    boost = fast * (slow + beta_size * near) + (1 - fast) * (1 - beta * y)
    return boost, fast * sense * (near - slow) + (1 - fast) * (beta - y)


def sky_from_fido(frame: Frame, direction: np.ndarray) -> np.ndarray:
    """Camera-sky direction N (..., 3) of photons that move along `direction` (..., 3) = (n_r, n_theta, n_phi).

    The inverse of `fido_from_sky`.
    """
    along = np.asarray(direction) @ np.asarray(frame.basis).T
    if frame.speed == 0:
        return unit(0.0 - along)
    boost, aberration = doppler(frame, (along[..., 0], along[..., 1], along[..., 2]))
    shrink = -math.sqrt(frame.slowness)
    parts = [shrink * along[..., 0] / boost, aberration / boost, shrink * along[..., 2] / boost]
    return unit(np.stack(parts, axis=-1))


def line_of_sight_from_sky(frame: Frame, sky: np.ndarray) -> np.ndarray:
    """Direction (..., 3) in FIDO components in which the camera looks at N (..., 3): against the photon's motion."""
    sky = np.asarray(sky)
    if frame.speed == 0:
        return sky @ np.asarray(frame.basis)
    return -np.stack(fido_from_sky(frame, (sky[..., 0], sky[..., 1], sky[..., 2])), axis=-1)


def sky_from_line_of_sight(frame: Frame, line_of_sight: np.ndarray) -> np.ndarray:
    """Camera-sky direction N (..., 3) of objects along `line_of_sight` (..., 3) = (r, theta, phi) of the FIDO.

    The inverse of `line_of_sight_from_sky`.
    """
    return sky_from_fido(frame, -np.asarray(line_of_sight))


def photon_of(frame: Frame, sky: tuple[Any, Any, Any]) -> Photon:
    """The photon that arrives from camera-sky direction N, with unit energy at infinity.

    sky holds the components N_x, N_y, N_z, floats or arrays of one shape. The rates are those of the
    photon's path followed backward in Mino time.

    References: JTFT A.1; K and kappa are written as sums of squares, so that they keep their
    digits near the principal null directions.
    """
    n_r, n_theta, n_phi = zoomed(frame, fido_from_sky(frame, sky))
    a, s, c = frame.spin, frame.sin_theta, frame.cos_theta
    energy_ratio = _energy_ratio(frame, n_phi)
    energy = 1 / energy_ratio
    p_theta = energy * frame.root_sigma * frame.zoom * n_theta
    p_phi = energy * frame.cylindrical_scale * n_phi
    b = p_phi * s
    u = 1 / frame.radius
    u_rate = u * u * energy * frame.root_sigma_delta * n_r
    zero = 0 * b
    return Photon(
        b=b,
        k=p_theta**2 + p_phi**2 - (a * c) ** 2,
        kappa=p_theta**2 + (p_phi - a * s) ** 2,
        q=p_theta**2 + c * c * (p_phi - a) * (p_phi + a),
        position=(u + zero, s + zero, zero, c + zero),
        rate=(u_rate, -c * p_theta, -p_phi, s * p_theta),
        energy_ratio=energy_ratio,
    )


def zoomed(frame: Frame, direction: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """Direction (n_r, n_theta / zoom, n_phi / zoom) in which a photon moves, from that on a magnified sky.

    Tangents of half the angle from the direction to the hole are multiplied by the zoom: angles stay, and both skies
    are whole. For a zoom of 1 nothing changes, to the bit.
    """
    n_r, n_theta, n_phi = direction
    square = frame.zoom * frame.zoom
    # Far out on a magnified sky 1 + n_r would cancel: it follows from the other two.
    far = (frame.zoom != 1) & (n_r < 0)
    toward = (n_theta * n_theta + n_phi * n_phi) / (1 - far * n_r) - square * (1 - n_r)
    along = (1 - far) * ((1 - square) + (1 + square) * n_r) + far * toward
    # Never 0, also straight away from the hole.
    size = (1 - far) * ((1 + square) + (1 - square) * n_r) + far * (toward + 2 * square * (1 - n_r)) + 1e-40
    return along / size, 2 * n_theta / size, 2 * n_phi / size


def _energy_ratio(frame: Frame, n_phi: Any) -> Any:
    """Energy at infinity per energy at the FIDO of a photon that moves there with the component n_phi / zoom."""
    return frame.lapse + frame.shift * frame.cylindrical_scale * frame.sin_theta * n_phi


def redshift(frame: Frame, sky: np.ndarray, photon: Photon | None = None) -> np.ndarray:
    """Frequency ratio nu_viewer / nu_source of light from a source at rest at infinity (JTFT A.1).

    Parameters: sky (..., 3), unit vectors; photon, that from there, if it is known. Returns (...,).
    Errors: exact to round-off.
    """
    parts = (sky[..., 0], sky[..., 1], sky[..., 2])
    energy_ratio = (
        _energy_ratio(frame, zoomed(frame, fido_from_sky(frame, parts))[2]) if photon is None else photon.energy_ratio
    )
    with np.errstate(divide="ignore"):
        return frequency_ratio(frame, parts, energy_ratio)


def frequency_ratio(frame: Frame, sky: tuple[Any, Any, Any], energy_ratio: Any) -> Any:
    """The same from the components of N and E_infinity / E_FIDO, floats or arrays of any kind."""
    return frame.slowness**0.5 / (doppler(frame, sky)[0] * energy_ratio)
