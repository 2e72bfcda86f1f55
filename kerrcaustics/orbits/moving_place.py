"""A place in motion, and its velocity as the fiducial observer measures it."""

import math
from typing import NamedTuple

from kerrcaustics.spacetime import kerr


class Place(NamedTuple):
    """Boyer-Lindquist coordinates (radius, theta, phi in radians), and their rates per coordinate time."""

    radius: float
    theta: float
    phi: float
    radius_rate: float
    theta_rate: float
    phi_rate: float


def fido_velocity(spin: float, place: Place) -> tuple[float, float, float]:
    """Velocity (v_r, v_theta, v_phi) of a motion as the fiducial observer at its place measures it.

    References: JTFT A.1 for the metric functions; nothing can have a speed of 1 or more.
    """
    cosine, sine = _cosine(place.theta), math.sin(place.theta)
    at = kerr.metric(spin, place.radius, cosine)
    root_sigma = math.sqrt(at.sigma)
    v_r = root_sigma / math.sqrt(at.delta) * place.radius_rate / at.lapse
    v_phi = at.cylindrical_scale * sine * (place.phi_rate - at.shift) / at.lapse
    return v_r, root_sigma * place.theta_rate / at.lapse, v_phi


def phi_rate(spin: float, radius: float, theta: float, v_phi: float) -> float:
    """dphi / dt of a motion whose velocity has the component v_phi, measured by the FIDO; 0 on the axis."""
    at = kerr.metric(spin, radius, _cosine(theta))
    scale = at.cylindrical_scale * math.sin(theta)
    return at.shift + at.lapse * v_phi / scale if scale > 1e-12 else 0.0


def _cosine(theta: float) -> float:
    return 0.0 if theta == math.pi / 2 else math.cos(theta)
