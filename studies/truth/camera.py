"""The camera of rays.py and the photons it sees, in mpmath, from docs/conventions.md alone."""

import math
from typing import NamedTuple

from mpmath import mp, mpf


class Place(NamedTuple):
    """A camera; velocity "circular", "fiducial", a speed along e_phi, or (v_r, v_theta, v_phi) measured by the FIDO.

    math.pi / 2 and math.pi mean the equator and the south pole exactly.
    """

    spin: float
    radius: float
    inclination: float
    velocity: str | float | tuple


class Metric(NamedTuple):
    """Metric functions at the camera, its speed along e_y, and e_x, e_y, e_z in FIDO components (JTFT A.1)."""

    sin: mpf
    cos: mpf
    sigma: mpf
    delta: mpf
    lapse: mpf
    shift: mpf
    varpi: mpf
    scale: mpf
    speed: mpf
    axes: tuple


class Photon(NamedTuple):
    """Constants b, q and first values (u, x, y, z), and rates, of the path followed backward in Mino time.

    energy, of unit energy at infinity as the FIDO measures it: no light from infinity where it is not positive.
    """

    b: mpf
    q: mpf
    position: list
    rate: list
    energy: mpf


def metric(place: Place) -> Metric:
    """Metric functions at the camera."""
    a, r = mpf(place.spin), mpf(place.radius)
    exact = {math.pi / 2: (mpf(1), mpf(0)), math.pi: (mpf(0), mpf(-1))}
    s, c = exact.get(place.inclination) or (mp.sin(mpf(place.inclination)), mp.cos(mpf(place.inclination)))
    sigma, delta = r**2 + (a * c) ** 2, r**2 - 2 * r + a**2
    big = mp.sqrt((r**2 + a**2) ** 2 - delta * (a * s) ** 2)
    lapse, shift, scale = mp.sqrt(sigma * delta) / big, 2 * a * r / big**2, big / mp.sqrt(sigma)
    axes = ((1, 0, 0), (0, 0, 1), (0, -1, 0))
    if place.velocity == "circular":
        speed = scale * s * (1 / (a + r * mp.sqrt(r)) - shift) / lapse
    elif isinstance(place.velocity, tuple):
        speed, axes = moving_axes([mpf(v) for v in place.velocity])
    else:
        speed = mpf(0) if place.velocity == "fiducial" else mpf(place.velocity)
    return Metric(s, c, sigma, delta, lapse, shift, scale * s, scale, speed, axes)


def moving_axes(velocity: list) -> tuple[mpf, tuple]:
    """Speed and camera axes for a velocity measured by the FIDO, as docs/conventions.md define them."""
    if velocity[0] == velocity[1] == 0:
        return velocity[2], ((1, 0, 0), (0, 0, 1), (0, -1, 0))
    x, y, z = unit(velocity)
    flat = mp.sqrt(x**2 + z**2)
    p, q = (z / flat, -x / flat) if flat else (mpf(1), mpf(0))
    # (p, 0, q) x (x, y, z).
    return mp.norm(velocity), ((p, 0, q), (x, y, z), (-q * y, q * x - p * z, p * y))


def unit(vector: list) -> list:
    """The vector divided by its length."""
    length = mp.sqrt(sum(mpf(v) ** 2 for v in vector))
    return [mpf(v) / length for v in vector]


def photon(place: Place, sky: list) -> Photon:
    """The photon seen in direction N, a unit vector in mpf (conventions.md)."""
    at, a, r = metric(place), mpf(place.spin), mpf(place.radius)
    doppler, shrink = 1 - at.speed * sky[1], -mp.sqrt(1 - at.speed**2)
    along = (shrink * sky[0] / doppler, (at.speed - sky[1]) / doppler, shrink * sky[2] / doppler)
    n_r, n_theta, n_phi = (sum(n * axis[i] for n, axis in zip(along, at.axes, strict=True)) for i in range(3))
    ratio = at.lapse + at.shift * at.varpi * n_phi
    energy = 1 / ratio if ratio else mp.inf
    p_theta, p_phi = energy * mp.sqrt(at.sigma) * n_theta, energy * at.scale * n_phi
    b, q = p_phi * at.sin, p_theta**2 + at.cos**2 * (p_phi**2 - a**2)
    u_rate = energy * mp.sqrt(at.sigma * at.delta) * n_r / r**2
    rate = [u_rate, -at.cos * p_theta, -p_phi, at.sin * p_theta]
    return Photon(b, q, [1 / r, at.sin, mpf(0), at.cos], rate, energy)
