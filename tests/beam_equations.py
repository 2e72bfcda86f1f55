"""Two slow, obvious propagators of light beams, for comparison with the package: they share no code with it.

Both take a camera as plain numbers and a camera-sky direction, follow one escaping ray backward with SciPy,
and return the diameters of the beam on the celestial sphere, delta_minus with the sign of det J.

`walker_penrose_beam` integrates the separation of neighbouring rays in a parallel-propagated frame, where the
tidal term of a type D space-time has a closed form, in Mino time and in u = 1/r, regular at infinity.
`pineault_roeder_beam` is the way of James, von Tunzelmann, Franklin & Thorne 2015 (JTFT) appendix A.2: the
super-Hamiltonian ray equations in Boyer-Lindquist coordinates, Psi_0* from the fiducial observers' frame,
and the rotation chi of that frame from its connection.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

ACCURACY = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-16}
FAR_RADIUS = 1e6


class Event(NamedTuple):
    """A camera as plain numbers; velocity is (v_r, v_theta, v_phi) relative to the fiducial observer."""

    spin: float
    radius: float
    inclination: float
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Photon(NamedTuple):
    """Constants of unit energy at infinity, momentum at the camera, and energy in the camera's frame."""

    b: float
    q: float
    p_r: float
    p_theta: float
    camera_energy: float


class Ellipse(NamedTuple):
    """Diameters of the image of a unit beam; index from one form, orientation (mod pi) from the other."""

    delta_plus: float
    delta_minus: float
    index: int | None = None
    orientation: float | None = None


def photon(event: Event, sky) -> Photon:
    """JTFT appendix A.1, steps i to iv, typed in afresh."""
    a, r, theta, velocity = event
    x, y, z = sky
    beta = math.hypot(*velocity)
    b_r, b_theta, b_phi = (v / beta for v in velocity) if beta > 0 else (0.0, 0.0, 1.0)
    if b_r == b_theta == 0:
        # Azimuthal motion of either sign keeps e_y = e_phi.
        beta, b_phi = beta * b_phi, 1.0
    kappa = math.hypot(b_r, b_phi)
    # Motion along e_theta alone: e_x = e_r is the limit of the azimuthal case.
    radial, azimuthal = (b_r / kappa, b_phi / kappa) if kappa > 0 else (0.0, 1.0)
    root = math.sqrt(1 - beta**2)
    doppler = 1 - beta * y
    n_x, n_y, n_z = -root * x / doppler, (beta - y) / doppler, -root * z / doppler
    n_r = azimuthal * n_x + b_r * n_y + radial * b_theta * n_z
    n_theta = b_theta * n_y - kappa * n_z
    n_phi = -radial * n_x + b_phi * n_y + azimuthal * b_theta * n_z
    at = Metric(a, r, theta)
    energy = 1 / (at.alpha + at.omega * at.varpi * n_phi)
    cosine, sine = at.cosine, at.sine
    p_theta = energy * at.rho * n_theta
    b = energy * at.varpi * n_phi
    return Photon(
        b=b,
        q=p_theta**2 + cosine**2 * ((b / sine) ** 2 - a**2),
        p_r=energy * at.rho / math.sqrt(at.delta) * n_r,
        p_theta=p_theta,
        camera_energy=energy * root / doppler,
    )


class Metric:
    """Metric functions of JTFT A.1 at one point, and logarithmic derivatives (d_r, d_theta)."""

    def __init__(self, a: float, r: float, theta: float) -> None:
        # At inclination pi/2 the cosine is exactly 0.
        self.cosine, self.sine = (0.0, 1.0) if theta == math.pi / 2 else (math.cos(theta), math.sin(theta))
        c, s = self.cosine, self.sine
        rho2 = r * r + (a * c) ** 2
        self.delta = r * r - 2 * r + a * a
        big = (r * r + a * a) ** 2 - a * a * self.delta * s * s
        self.rho = math.sqrt(rho2)
        self.alpha = math.sqrt(rho2 * self.delta / big)
        self.omega = 2 * a * r / big
        self.varpi = math.sqrt(big / rho2) * s
        d_rho2 = (2 * r, -2 * a * a * c * s)
        d_delta = (2 * r - 2, 0.0)
        d_big = (4 * r * (r * r + a * a) - a * a * s * s * d_delta[0], -2 * a * a * self.delta * s * c)
        self.log_rho = tuple(d / (2 * rho2) for d in d_rho2)
        self.log_root_delta = tuple(d / (2 * self.delta) for d in d_delta)
        log_root_big = tuple(d / (2 * big) for d in d_big)
        self.log_alpha = tuple(self.log_rho[i] + self.log_root_delta[i] - log_root_big[i] for i in (0, 1))
        self.log_varpi = (log_root_big[0] - self.log_rho[0], log_root_big[1] - self.log_rho[1] + c / s)
        self.d_omega = (self.omega * (1 / r - d_big[0] / big), -self.omega * d_big[1] / big)


# The short form.


def walker_penrose_beam(event: Event, sky) -> Ellipse:
    """Beam by xi'' = -3 K (r + i a cos theta)^-5 conj(eta) and its twin, with Y = xi / sqrt(Sigma).

    In Mino time the end u = 0 is a regular point; there |Y| is the angular displacement.
    """
    light = photon(event, sky)
    a, r, theta, _ = event
    at = Metric(a, r, theta)

    def rates(_, state):
        return _short_form_rates(a, light, state)

    def at_infinity(_, state):
        return state[0]

    at_infinity.terminal, at_infinity.direction = True, -1
    u_rate = light.p_r * at.delta / r**2
    start = [1 / r, u_rate, at.cosine, at.sine * light.p_theta, *[0.0] * 4]
    start += [at.rho * light.camera_energy, 0.0, 0.0, 0.0]
    path = solve_ivp(rates, (0, 1e3), start, events=at_infinity, dense_output=True, **ACCURACY)
    assert path.status == 1
    # The dense output is of lower order: integrate the last step again, and land by one Taylor step.
    last = solve_ivp(rates, (path.t[-2], path.t[-1]), path.y[:, -2], **ACCURACY).y[:, -1]
    rest = -last[0] / last[1]
    even, odd = _complex(last[4:8] + rest * last[8:12])
    return Ellipse(abs(even) + abs(odd), abs(even) - abs(odd), index=_area_zeros(path))


def _short_form_rates(a: float, light: Photon, state: np.ndarray) -> list[float]:
    u, w, mu, nu, even_1, even_2, odd_1, odd_2, *slopes = state.tolist()
    b, q = light.b, light.q
    kappa = (b - a) ** 2 + q
    # U'(u) / (2 u), with U = 1 + (a^2 - b^2 - q) u^2 + 2 kappa u^3 - a^2 q u^4.
    pull = a * a - b * b - q + 3 * kappa * u - 2 * a * a * q * u * u
    # mu'^2 = q + (a^2 - b^2 - q) mu^2 - a^2 mu^4.
    bend = a * a - b * b - q - 2 * a * a * mu * mu
    # 1 / sqrt(Sigma) = u h, h = (1 + X^2)^(-1/2), X = a mu u.
    x, x1 = a * mu * u, a * (nu * u + mu * w)
    x2 = a * (bend * mu * u + 2 * nu * w + mu * pull * u)
    g = 1 / (1 + x * x)
    bend_h = -(x1 * x1 + x * x2) * g + 3 * (x * x1 * g) ** 2
    spread = pull - 2 * w * a * mu * x1 * g + bend_h
    tide = 3 * kappa * u * (1 + 1j * x) ** 2 / (1 - 1j * x) ** 3
    even, odd = complex(even_1, even_2), complex(odd_1, odd_2)
    even_2nd = spread * even + tide * odd.conjugate()
    odd_2nd = spread * odd + tide * even.conjugate()
    return [w, pull * u, nu, bend * mu, *slopes, even_2nd.real, even_2nd.imag, odd_2nd.real, odd_2nd.imag]


def _complex(parts: np.ndarray) -> tuple[complex, complex]:
    return complex(parts[0], parts[1]), complex(parts[2], parts[3])


def _area_zeros(path) -> int:
    """Sign changes of the beam's area |xi|^2 - |eta|^2 along the ray, the camera excluded."""
    part = np.arange(1, 9) / 8
    times = (path.t[:-1, None] + np.diff(path.t)[:, None] * part).ravel()
    y = path.sol(times)
    area = y[4] ** 2 + y[5] ** 2 - y[6] ** 2 - y[7] ** 2
    return int(np.sum(np.sign(area[1:]) != np.sign(area[:-1])))


# The form of Pineault and Roeder.


def pineault_roeder_beam(event: Event, sky) -> Ellipse:
    """Beam by JTFT A.2 in affine parameter, to a radius of a million.

    With xi = u + i v, eta = g + i h the equations are xi'' = -Psi_0* exp(-2 i chi) conj(eta), and its twin.
    Errors: the slopes have converged as kappa / r^3, 1e-15 here; chi as 1 / r, whose first term is added.
    """
    light, end, final = _pineault_roeder(event, sky, FAR_RADIUS)
    even, odd = _complex(end[9:])
    chi = end[4] + final[4] / final[0] * end[0]
    size = light.camera_energy
    major = chi + (math.atan2(even.imag, even.real) + math.atan2(odd.imag, odd.real)) / 2
    return Ellipse(size * (abs(even) + abs(odd)), size * (abs(even) - abs(odd)), orientation=major % math.pi)


class Section(NamedTuple):
    """A beam at a radius: its diameters as lengths, and the major axis in the fiducial observer's r, theta, phi."""

    delta_plus: float
    delta_minus: float
    axis: np.ndarray


def pineault_roeder_at(event: Event, sky, radius: float) -> Section:
    """Beam by JTFT A.2 where its ray comes to a radius beyond the camera's."""
    light, end, _ = _pineault_roeder(event, sky, radius)
    even, odd = _complex(end[5:9])
    major = end[4] + (math.atan2(even.imag, even.real) + math.atan2(odd.imag, odd.real)) / 2
    at, size = Metric(event.spin, *end[:2]), light.camera_energy
    energy = (1 - at.omega * light.b) / at.alpha
    n = (end[2] * math.sqrt(at.delta) / (at.rho * energy), end[3] / (at.rho * energy), light.b / (at.varpi * energy))
    first, second = np.array(_screen(n))
    axis = math.cos(major) * first + math.sin(major) * second
    return Section(size * (abs(even) + abs(odd)), size * (abs(even) - abs(odd)), axis)


def _pineault_roeder(event: Event, sky, radius: float) -> tuple[Photon, np.ndarray, tuple[float, ...]]:
    """The photon, the state and its rates where the ray comes to a radius beyond the camera's."""
    light = photon(event, sky)
    a, r, theta, _ = event

    def rates(_, state):
        return _pineault_roeder_rates(a, light, state)

    def is_far(_, state):
        return state[0] - radius

    is_far.terminal = True
    start = [r, theta, light.p_r, light.p_theta, 0.0, *[0.0] * 4, 1.0, 0.0, 0.0, 0.0]
    path = solve_ivp(rates, (0, -1e8), start, events=is_far, **ACCURACY)
    assert path.status == 1
    # The event is of lower order than the steps: the last one again, and a Taylor step onto it.
    last = solve_ivp(rates, (path.t[-2], path.t[-1]), path.y[:, -2], **ACCURACY).y[:, -1]
    rest = (radius - last[0]) / rates(0, last)[0]
    last = last + rest * np.array(rates(0, last))
    return light, last, rates(0, last)


def _pineault_roeder_rates(a: float, light: Photon, state: np.ndarray) -> list[float]:
    r, theta, p_r, p_theta, chi, even_1, even_2, odd_1, odd_2, *slopes = state.tolist()
    b = light.b
    at = Metric(a, r, theta)
    velocity = _hamilton(a, light, at, r, p_r, p_theta)
    energy = (1 - at.omega * b) / at.alpha
    n = (p_r * math.sqrt(at.delta) / (at.rho * energy), p_theta / (at.rho * energy), b / (at.varpi * energy))
    tide = _psi_0(a, at, r, energy, n) * complex(math.cos(2 * chi), -math.sin(2 * chi))
    even_2nd = -tide * complex(odd_1, -odd_2)
    odd_2nd = -tide * complex(even_1, -even_2)
    turning = _frame_rotation(light, at, (p_r, p_theta), velocity, energy, n)
    return [*velocity, turning, *slopes, even_2nd.real, even_2nd.imag, odd_2nd.real, odd_2nd.imag]


def _hamilton(a: float, light: Photon, at: Metric, r: float, p_r: float, p_theta: float) -> tuple[float, ...]:
    """(r', theta', p_r', p_theta') with respect to the affine parameter (JTFT A.2)."""
    b, kappa = light.b, (light.b - a) ** 2 + light.q
    rho2, delta, c, s = at.rho**2, at.delta, at.cosine, at.sine
    # F = (R + Delta Theta) / (2 Delta rho^2) holds b and q through these two functions of position.
    axial = r * r + a * a - a * b
    radial, d_radial = axial**2 - delta * kappa, 4 * r * axial - (2 * r - 2) * kappa
    theta_part = light.q - c * c * ((b / s) ** 2 - a * a)
    d_theta_part = 2 * c * (b * b / s**3 - a * a * s)
    inner = -delta * p_r**2 - p_theta**2 + radial / delta + theta_part
    d_inner_r = -(2 * r - 2) * p_r**2 + d_radial / delta - radial * (2 * r - 2) / delta**2
    d_r = (d_inner_r - 2 * inner * at.log_rho[0]) / (2 * rho2)
    d_theta = (d_theta_part - 2 * inner * at.log_rho[1]) / (2 * rho2)
    return delta * p_r / rho2, p_theta / rho2, d_r, d_theta


def _screen(n: tuple[float, float, float]) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """The unit vectors a, b of JTFT, normal to n, in components (r, theta, phi)."""
    n_r, n_theta, n_phi = n
    f = 1 / (1 - n_r)
    cross = -n_theta * n_phi * f
    return (n_theta, 1 - n_theta**2 * f, cross), (n_phi, cross, 1 - n_phi**2 * f)


def _psi_0(a: float, at: Metric, r: float, energy: float, n: tuple[float, float, float]) -> complex:
    """Psi_0* from the tidal field of the fiducial observers (JTFT A.2)."""
    w = a * a * at.delta * at.sine**2 / (r * r + a * a) ** 2
    m_r, m_theta, m_phi = (complex(x, y) for x, y in zip(*_screen(n), strict=True))
    tidal = -(2 + w) * m_r**2 + (1 + 2 * w) * m_theta**2 + (1 - w) * m_phi**2
    # sqrt(w) has the sign of sin(theta), for rays that go on to negative theta beyond the axis.
    tidal += 6j * a * math.sqrt(at.delta) * at.sine / (r * r + a * a) * m_r * m_theta
    return energy**2 / complex(r, a * at.cosine) ** 3 * tidal / (1 - w)


def _frame_rotation(light, at, momentum, velocity, energy, n) -> float:
    """chi' = M: the rate at which a parallel-propagated frame turns against a, b, by the connection.

    The tetrad of the fiducial observers is e^t = alpha dt, e^r = rho / sqrt(Delta) dr, e^theta = rho dtheta,
    e^phi = varpi (dphi - omega dt). Only the purely spatial part of the connection matters here.
    """
    r_rate, theta_rate, p_r_rate, p_theta_rate = velocity

    def along(gradient):
        return gradient[0] * r_rate + gradient[1] * theta_rate

    d_log_energy = -light.b * along(at.d_omega) / (1 - at.omega * light.b) - along(at.log_alpha)
    d_log_rho = along(at.log_rho)
    n_r, n_theta, n_phi = n
    dn_r = n_r * (along(at.log_root_delta) - d_log_rho - d_log_energy)
    dn_r += math.sqrt(at.delta) / (at.rho * energy) * p_r_rate
    dn_theta = p_theta_rate / (at.rho * energy) - n_theta * (d_log_rho + d_log_energy)
    dn_phi = -n_phi * (along(at.log_varpi) + d_log_energy)
    f = 1 / (1 - n_r)
    da = (
        dn_theta,
        -(2 * n_theta * dn_theta + n_theta**2 * f * dn_r) * f,
        -(dn_theta * n_phi + n_theta * dn_phi + n_theta * n_phi * f * dn_r) * f,
    )
    first, second = _screen(n)
    # Unit lengths along e_r, e_theta.
    to_r, to_theta = math.sqrt(at.delta) / at.rho, 1 / at.rho
    drag_r, drag_theta = (at.varpi * d / (2 * at.alpha) for d in at.d_omega)
    phi_r = to_r * energy * (at.log_varpi[0] * n_phi - drag_r)
    phi_theta = to_theta * energy * (at.log_varpi[1] * n_phi - drag_theta)
    r_theta = energy * (to_theta * at.log_rho[1] * n_r - to_r * at.log_rho[0] * n_theta)
    turned = (
        r_theta * first[1] - phi_r * first[2],
        -r_theta * first[0] - phi_theta * first[2],
        phi_r * first[0] + phi_theta * first[1],
    )
    return -sum(s * (d + t) for s, d, t in zip(second, da, turned, strict=True))
