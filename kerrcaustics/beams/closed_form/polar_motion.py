"""The polar motion of a ray in theta functions: a point m of the unit sphere, smooth through equator and axis.

With the polar phase z, proportional to Mino time and zero where the ray crosses the equator,

    m_x -+ i m_y = e^(i drift z) [F(z) / F(0)] [theta_3(0) / theta_3(z)],    m_z = amplitude sd(z),

up to a constant phase, with the upper sign for b > 0. F is a theta function with its zeros on the spin axis, written
as a polynomial in e^(2 i z) (the factor e^(-i z) that it lacks is in drift). For k = q + b^2 >= 2 its nome is below
0.026, and the terms kept here are exact to round-off.

References: DLMF 20.2, 22.2; the solution of Lame's equation of degree 1 (Whittaker & Watson 23.7).
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.geometry import first_azimuth
from kerrcaustics.spacetime import elliptic
from kerrcaustics.spacetime.arrays import Components, Reals
from kerrcaustics.spacetime.frame import Frame, Photon

# Powers of e^(2 i z) in F.
_POWERS = (0, 1, -1, 2, -2, 3, -3)


class PolarRates(NamedTuple):
    """Values at the end for the variation of the polar motion.

    rate: components of m', not turned yet, as those of m.
    lift: root of q, in the equatorial plane m_z' at the camera, with its sign.
    height: m_z divided by the lift.
    slow: integral of a^2 m_z^2 divided by q.
    rho: (k - a^2)^2 + 4 a^2 q.
    """

    rate: Components
    lift: Reals
    height: Reals
    slow: Reals
    rho: Reals


class Polar(NamedTuple):
    """m = (x, y, z) at the end, still to be turned about the axis by `turn`.

    x: first component of m.
    y: second component of m.
    z: third component of m.
    turn: turn about the axis, radians.
    azimuth: azimuth of m plus the turn, unwrapped, radians.
    phase: the z gone through.
    crossings: crossings of the equatorial plane.
    leaving: positive where the ray moves away from that plane.
    clock: integral of a^2 m_z^2, None if not requested.
    rates: values for variations, None if not requested.
    """

    x: Reals
    y: Reals
    z: Reals
    turn: Reals
    azimuth: Reals
    phase: Reals
    crossings: Reals
    leaving: Reals
    clock: Reals | None
    rates: PolarRates | None = None


class Swing(NamedTuple):
    """The polar oscillation of one ray: see the module's formula.

    modulus: modulus of the elliptic functions.
    frequency: rate of the argument of sn in Mino time.
    rate: dz / dtau.
    nome: the nome q.
    nome_slope: the nome over modulus.part.
    terms: coefficients of F.
    drift: drift of the turn about the axis.
    scale: theta_3(0) over the sum of these coefficients.
    first: phase of the camera.
    """

    modulus: elliptic.Modulus
    frequency: Reals
    rate: Reals
    nome: Reals
    nome_slope: Reals
    terms: tuple[Reals, ...]
    drift: Reals
    scale: Reals
    first: Reals


class _Thetas(NamedTuple):
    """The oscillation at one phase: F = f_real + i f_imag, theta_3, sd, and their derivatives by z.

    waves, that of theta_3, is divided by the nome.
    """

    f_real: Reals
    f_imag: Reals
    theta3: Reals
    sd: Reals
    f_real_slope: Reals
    f_imag_slope: Reals
    waves: Reals
    sd_slope: Reals


def polar_swing(frame: Frame, photon: Photon, *, on_equator: bool) -> Swing:
    """The polar oscillation of a ray."""
    return _swing(frame, photon, _sense(photon) * photon.b, on_equator=on_equator)


def time_to_plane(frame: Frame, swing: Swing, crossing: Reals) -> Reals:
    """Mino time from the camera to the n-th crossing of the equatorial plane, for a ray that does not stay in it."""
    before = jax.lax.stop_gradient(_half_turns(swing.first, frame.cos_theta))
    return ((before + crossing) * math.pi - swing.first) / swing.rate


def polar_motion(
    frame: Frame,
    photon: Photon,
    swing: Swing,
    time: Reals,
    *,
    on_equator: bool,
    with_time: bool = False,
    varied: bool = False,
) -> Polar:
    """The polar motion over a Mino time, from the camera; with the clock, and rates for variations, if requested.

    Errors: about 1e-16 times the phase.
    """
    sense = _sense(photon)
    phase, first = swing.rate * time, swing.first
    end = _theta_functions(swing, first + phase)
    moving = _moving(swing, end)
    azimuth = jnp.arctan2(end.f_imag, end.f_real)
    if not on_equator:
        c, s, offset = _offset(frame, photon, swing, _theta_functions(swing, first), sense)
        moving = [(c * x + s * y, c * y - s * x) for x, y in moving]
        azimuth = azimuth - offset
    turn = sense * swing.drift * phase
    crossings = _half_turns(first + phase, end.sd) - _half_turns(first, frame.cos_theta)
    # A ray that stays in the plane does not cross it.
    crossings = jnp.where(photon.q == 0, 0.0, crossings)
    # On the equator it carries the sign of p_theta: smooth where the ray stays in the plane.
    lift = photon.rate[3] if on_equator else jnp.sqrt(photon.q)
    slow = _slow(swing, end, phase, on_equator=on_equator) if with_time or varied else 0.0
    (x, y), (x_rate, y_rate) = moving
    return Polar(
        x=x,
        y=sense * y,
        z=lift / swing.frequency * end.sd,
        turn=turn,
        azimuth=turn + sense * azimuth,
        phase=phase,
        crossings=crossings,
        leaving=end.sd * end.sd_slope,
        clock=swing.modulus.part * slow if with_time else None,
        rates=_rates(swing, end, (x_rate, sense * y_rate), lift, slow) if varied else None,
    )


def _rates(swing: Swing, end: _Thetas, across: tuple[Reals, Reals], lift: Reals, slow: Reals) -> PolarRates:
    z_rate = lift / swing.frequency * swing.rate * end.sd_slope
    square = swing.frequency**2
    # q over the modulus' part is complement square.
    slow = slow / (swing.modulus.complement * square)
    return PolarRates((*across, z_rate), lift, end.sd / swing.frequency, slow, square**2)


def _sense(photon: Photon) -> Reals:
    return jnp.where(photon.b < 0, -1.0, 1.0)


def _slow(swing: Swing, end: _Thetas, phase: Reals, *, on_equator: bool) -> Reals:
    """The integral of a^2 m_z^2 over Mino time, over modulus.part: it is rate^2 (ln theta_3)'' but for a constant."""
    nome = swing.nome
    n3 = nome**3
    constant = 8 * (1 + 4 * n3 + 9 * n3 * n3 * nome**2) / elliptic.theta3(nome)
    waves = end.waves / end.theta3
    if not on_equator:
        start = _theta_functions(swing, swing.first)
        waves = waves - start.waves / start.theta3
    return swing.nome_slope * swing.rate * (waves + constant * phase)


def _half_turns(z: Reals, side: Reals) -> Reals:
    """Half turns of a phase; the side of the plane settles those within round-off of a whole number."""
    turns = jnp.floor(z / math.pi)
    wrong = (jnp.mod(turns, 2) == 1) != (side < 0)
    nearest = jnp.where(z / math.pi - turns < 0.5, turns - 1, turns + 1)
    return jnp.where(wrong & (side != 0), nearest, turns)


def _swing(frame: Frame, photon: Photon, b: Reals, *, on_equator: bool) -> Swing:
    """The oscillation for b >= 0."""
    a = frame.spin
    c = photon.k - a * a
    root = jnp.sqrt(c * c + 4 * a * a * photon.q)
    half = (c + root) / 2
    frequency = jnp.sqrt(root)
    # The square of the largest height of m is the modulus' part: all that vanishes with it is kept as a multiple.
    modulus = elliptic.Modulus(a * a / root, photon.q / half, half / root)
    nome_slope = elliptic.nome_slope(modulus)
    nome = nome_slope * modulus.part
    amplitude = None if on_equator else _amplitude(frame, photon, modulus, frequency)
    decay_slope, delay = elliptic.landen(modulus, b / jnp.sqrt(half + a * a), amplitude)
    rate = frequency / elliptic.theta3(nome) ** 2
    decay, growth = decay_slope * modulus.part, nome_slope / decay_slope
    n2, n4 = nome**2, nome**4
    terms = (1.0, decay, nome * growth, n2 * decay**2, n4 * growth**2, n4 * n2 * decay**3, n4 * n4 * nome * growth**3)
    total = sum(terms)
    # The azimuth of m changes at the rate b on the equator.
    drift = -b / rate - 2 * sum(n * term for n, term in zip(_POWERS, terms, strict=True)) / total
    first = 0.0 * rate if amplitude is None else jnp.arctan2(*amplitude) - delay + math.pi / 2
    return Swing(modulus, frequency, rate, nome, nome_slope, terms, drift, elliptic.theta3(nome) / total, first)


def _amplitude(frame: Frame, photon: Photon, modulus: elliptic.Modulus, frequency: Reals) -> tuple[Reals, Reals]:
    """Sine and cosine of the amplitude at the camera: m_z = sqrt(part) cn, m_z' = -sqrt(part) frequency sn dn."""
    dn = jnp.sqrt(modulus.complement + modulus.slope * frame.cos_theta**2)
    sine, cosine = -photon.rate[3] / (frequency * dn), frame.cos_theta
    # Hypot would have no derivative for a camera in the plane whose ray stays there; that camera is not here.
    size = jnp.sqrt(sine**2 + cosine**2)
    return sine / size, cosine / size


def _theta_functions(swing: Swing, z: Reals) -> _Thetas:
    c1, s1 = jnp.cos(z), jnp.sin(z)
    c2, s2 = c1 * c1 - s1 * s1, 2 * c1 * s1
    c4, s4 = c2 * c2 - s2 * s2, 2 * c2 * s2
    c6, s6 = c4 * c2 - s4 * s2, s4 * c2 + c4 * s2
    _, p1, m1, p2, m2, p3, m3 = swing.terms
    nome = swing.nome
    n4 = nome**4
    n3, n8 = nome**3, n4 * n4
    theta3 = 1 + 2 * (nome * c2 + n4 * c4 + n8 * nome * c6)
    waves = -4 * (s2 + 2 * n3 * s4 + 3 * n8 * s6)
    sd = elliptic.sd(nome, theta3, s1, s1 * c2 + c1 * s2, s1 * c4 + c1 * s4)
    theta1_slope = elliptic.sd(nome, theta3, c1, 3 * (c1 * c2 - s1 * s2), 5 * (c1 * c4 - s1 * s4))
    return _Thetas(
        f_real=1 + (p1 + m1) * c2 + (p2 + m2) * c4 + (p3 + m3) * c6,
        f_imag=(p1 - m1) * s2 + (p2 - m2) * s4 + (p3 - m3) * s6,
        theta3=theta3,
        sd=sd,
        f_real_slope=-2 * ((p1 + m1) * s2 + 2 * (p2 + m2) * s4 + 3 * (p3 + m3) * s6),
        f_imag_slope=2 * ((p1 - m1) * c2 + 2 * (p2 - m2) * c4 + 3 * (p3 - m3) * c6),
        waves=waves,
        sd_slope=theta1_slope - sd * nome * waves / theta3,
    )


def _moving(swing: Swing, at: _Thetas) -> tuple[tuple[Reals, Reals], tuple[Reals, Reals]]:
    """(x, y) of m but for a constant phase and `turn`, for b > 0, and the rates of m, turned alike."""
    scale, slope = swing.scale / at.theta3, swing.nome * at.waves / at.theta3
    x, y = scale * at.f_real, scale * at.f_imag
    x_rate = swing.rate * (scale * at.f_real_slope - swing.drift * y - slope * x)
    y_rate = swing.rate * (scale * at.f_imag_slope + swing.drift * x - slope * y)
    return (x, y), (x_rate, y_rate)


def _offset(frame: Frame, photon: Photon, swing: Swing, start: _Thetas, sense: Reals) -> tuple[Reals, Reals, Reals]:
    """The phase of the formula at the camera, where m lies at azimuth 0: its cosine and sine, and itself, unwrapped.

    Position and rate of m are compared together, since one of them may vanish: a camera close to the axis has no
    position to speak of.
    """
    (x, y), (x_rate, y_rate) = _moving(swing, start)
    weight = 1 / swing.frequency**2
    u, v = weight * photon.rate[1], weight * sense * photon.rate[2]
    along = frame.sin_theta * x + u * x_rate + v * y_rate
    across = frame.sin_theta * y + u * y_rate - v * x_rate
    size = jnp.sqrt(along**2 + across**2)
    offset = jnp.arctan2(across, along)
    # On the axis F vanishes: its slope is what it has right after, along the azimuth in which the ray leaves.
    beyond = jnp.arctan2(start.f_imag_slope, start.f_real_slope) - sense * first_azimuth(frame, photon.rate)
    rough = jnp.where(frame.sin_theta == 0, beyond, jnp.arctan2(start.f_imag, start.f_real))
    turns = jax.lax.stop_gradient(jnp.round((rough - offset) / (2 * math.pi)))
    return along / size, across / size, offset + 2 * math.pi * turns
