"""Rays and beams in closed form: elliptic integrals for r, theta functions for theta and phi.

The path is that of integrated.py: n' is a point m of the unit sphere, at the Mino time T of arrival, turned about the
spin axis by psi. T and psi are Carlson integrals of the radial motion. m is a quotient of theta functions of the polar
phase z, proportional to Mino time, with no singular point: with Theta(z) the series below,

    m_x + i m_y = e^(i (lambda - 1) z) Theta(z) / theta_3(z),   m_z = amplitude sd(z),

up to a constant phase. Beams are the first variation of all this in two directions of the camera sky, by forward
differentiation; the Morse index follows from z and the sign of det J.

It holds for k = q + b^2 >= LEAST_K. Rays below that leave close to the principal null directions: they are short, and
are integrated.

All functions work elementwise on JAX arrays of one shape, one entry a ray.
"""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.geometry import dot, length
from kerrcaustics.beams.polar import polar_motion
from kerrcaustics.spacetime import elliptic, radial
from kerrcaustics.spacetime.camera import Frame, Photon, photon
from kerrcaustics.spacetime.sphere import polar_basis, tangent_basis

Array = Any

# The parameter of the polar elliptic functions is then at most 1/3, and there are no vortical rays.
LEAST_K = 2.0
# The polar phase is known to 1e-14; conjugate points that lie at a multiple of pi (a = 0) must not be counted twice.
_PHASE_MARGIN = 1e-9
# Distance of the camera from the middle of the outer roots, relative to their radius, that counts as close.
_NEAR_ROOTS = 0.1


class End(NamedTuple):
    """A ray at infinity, as in integrated.py. What was not asked for is None.

    noise, the part of the error that is round-off of these formulas; certified, False where they do not hold.
    """

    direction: tuple[Array, Array, Array]
    azimuth: Array
    error: Array
    noise: Array
    captured: Array
    certified: Array
    jacobian: tuple[tuple[Array, ...], ...] | None = None
    jacobian_error: Array | None = None
    conjugate_points: Array | None = None
    crossings: Array | None = None


class _Way(NamedTuple):
    """What is known of a ray beside its direction n'."""

    azimuth: Array
    phase: Array
    crossings: Array
    captured: Array
    certified: Array
    spread: Array
    noise: Array
    jacobian_noise: Array


def trace(
    frame: Frame,
    sky: tuple[Array, Array, Array],
    *,
    on_equator: bool,
    beams: bool,
    index: bool = False,
    crossings: bool = False,
) -> End:
    """Rays, or beams, from camera-sky directions to infinity.

    Parameters: sky, three arrays N_x, N_y, N_z; on_equator, whether the camera is exactly there, which is cheaper;
    beams, index, crossings: what to compute beside n'.
    """

    def ray(*n: Array) -> tuple[tuple[Array, Array, Array], _Way]:
        return _ray(frame, n, on_equator)

    if not beams:
        direction, way = ray(*sky)
        return _end(way, direction, way.spread, crossings=crossings)
    direction, vary, way = jax.linearize(ray, *sky, has_aux=True)
    basis = jnp.stack(tangent_basis(jnp.stack(sky, axis=-1), jnp))
    columns = jax.vmap(lambda change: vary(*(change[..., i] for i in range(3))))(basis)
    rows = [tuple(e[..., i] for i in range(3)) for e in polar_basis(jnp.stack(direction, axis=-1), jnp)]
    jacobian = tuple(tuple(dot(row, [c[j] for c in columns]) for j in range(2)) for row in rows)
    spread = length([entry for row in jacobian for entry in row])
    end = _end(way, direction, spread, crossings=crossings)
    hidden = 0 * end.error
    determinant = jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0]
    return end._replace(
        jacobian=tuple(tuple(entry + hidden for entry in row) for row in jacobian),
        jacobian_error=jnp.minimum(way.jacobian_noise + end.error, 1.0),
        certified=end.certified & (end.captured | jnp.isfinite(spread)),
        conjugate_points=_conjugate_points(way.phase, determinant) if index else None,
    )


def _end(way: _Way, direction: tuple[Array, Array, Array], spread: Array, *, crossings: bool) -> End:
    hidden = jnp.where(way.captured, jnp.nan, 0.0)
    return End(
        direction=tuple(n + hidden for n in direction),
        azimuth=way.azimuth + hidden,
        error=jnp.minimum(way.noise + 2e-15 * spread * (1 + 0.3 * way.phase), math.pi) + hidden,
        noise=way.noise,
        captured=way.captured,
        certified=way.certified,
        crossings=way.crossings if crossings else None,
    )


def _conjugate_points(phase: Array, determinant: Array) -> Array:
    """The Morse index: the k-th conjugate point lies in the k-th half turn of the polar phase.

    So the index is the number of half turns or one more, and the sign of det J tells which. (Found, not proved: no
    exception in any ray of tests/test_closed_form.py and of the integrator.)
    """
    turns = jnp.floor(phase / math.pi - _PHASE_MARGIN)
    odd = jnp.mod(turns, 2) == 1
    return turns + (odd != (determinant < 0))


def _ray(frame: Frame, sky: tuple[Array, ...], on_equator: bool) -> tuple[tuple[Array, Array, Array], _Way]:
    light = photon(frame, sky)
    quartic = radial.factor(*radial.potential_coefficients(frame.spin, light))
    time, psi = _radial_motion(frame, light, quartic)
    m = polar_motion(frame, light, time, on_equator=on_equator)
    c, s = jnp.cos(psi + m.turn), jnp.sin(psi + m.turn)
    direction = (c * m.x - s * m.y, s * m.x + c * m.y, m.z)
    captured = radial.is_captured(frame, light, quartic)
    noise = _noise(frame, light, quartic, m.phase)
    way = _Way(
        azimuth=psi + m.azimuth,
        phase=m.phase,
        crossings=m.crossings,
        captured=captured,
        certified=captured | ((light.k >= LEAST_K) & jnp.isfinite(length(direction))),
        spread=_spread(frame, sky, light, quartic),
        noise=noise,
        jacobian_noise=9 * noise + 1e-15 * jnp.sqrt(jnp.maximum(light.k, 0)),
    )
    return direction, jax.lax.stop_gradient(way)


def _noise(frame: Frame, light: Photon, quartic: radial.Quartic, phase: Array) -> Array:
    """Round-off of the formulas, in radians for a beam of unit spread; the factors were measured.

    psi is a difference of two integrals divided by r_+ - r_-. Close to the hole, photons that move with its horizon,
    2 r_+ = a b, are the worst. Rounding b and q moves the outer roots: the last term is what that does to the time.
    """
    outer, inner = _horizons(frame.spin)
    corotation = jnp.abs(2 * outer - frame.spin * light.b) * (1 + 40 * (frame.radius - outer) ** 2)
    moved = light.k**1.5 * quartic.h**2 * _time_slope(frame, light, quartic)
    return 2e-15 * (1 + 0.3 * phase) + 4e-15 * frame.spin / (outer - inner) * (1 + 0.3 / corotation) + 3e-16 * moved


def _time_slope(frame: Frame, light: Photon, quartic: radial.Quartic) -> Array:
    """How much the Mino time changes with the potential R where the ray lingers, near the outer roots."""
    # A ray that leaves outward from above the roots does not linger there.
    away = (light.rate[0] < 0) & (frame.radius > quartic.h)
    gap = jnp.abs(quartic.d) + jnp.where(away, (frame.radius - quartic.h) ** 2, 0.0)
    return 1 / (jnp.abs(4 * quartic.h**2 - quartic.e) ** 1.5 * gap)


def _spread(frame: Frame, sky: tuple[Array, ...], light: Photon, quartic: radial.Quartic) -> Array:
    """An estimate of the beam's major diameter for a ray that is traced alone, mostly one to ten times too large."""
    a, h = frame.spin, quartic.h
    momentum = jnp.sqrt(light.k + a * a)
    slope = 2 * momentum * (jnp.abs(h * (h - 2) + a * a) + 0.1 * h) + 2 * a * jnp.abs(h * h + a * a - a * light.b)
    energy = (1 - frame.speed**2) ** 0.5 / ((1 - frame.speed * sky[1]) * jnp.abs(light.energy_ratio))
    return energy * (1 + frame.cylindrical_scale * momentum * slope * _time_slope(frame, light, quartic))


def _radial_motion(frame: Frame, light: Photon, quartic: radial.Quartic) -> tuple[Array, Array]:
    """Mino time to infinity, and the turn psi about the spin axis on the way.

    psi = -a / (r_+ - r_-) [I(r_+) - I(r_-)], I(r_h) = (2 r_h - a b) times the integral of d tau / (r - r_h). Since
    R(r_h) = (2 r_h - a b)^2, all logarithms are of rational functions. The integrals are referred to the lowest root.

    References: Carlson 1988 (Math. Comp. 51, 267); DLMF 19.29.4 to 19.29.8.
    """
    a, r = frame.spin, frame.radius
    h, d = quartic.h, quartic.d
    low = a * a * light.q / (h * h - d)
    e = h * h + low
    low_root, next_root = -h - jnp.sqrt(e), low / (h + jnp.sqrt(e))
    inner = jnp.sqrt((r - low_root) * (r - next_root))
    outer = -light.rate[0] * r**2 / inner
    # Close to the turning point the rate at the camera knows d better than the coefficients of R do.
    near = jnp.abs(r - h) < _NEAR_ROOTS * h
    d = jnp.where(near, (r - h - outer) * (r - h + outer), d)
    triple = _arguments(r, h, d, e, inner, outer)
    below = (low_root - h) ** 2 - d
    poles, rates, logs = [], [], []
    for horizon in _horizons(a):
        from_root = horizon - low_root
        rate = (2 * horizon - a * light.b) / from_root
        ratio = (horizon - next_root) / from_root
        pole = elliptic.Pole(triple.root**2 - below * ratio, (next_root - low_root) * below * rate / from_root)
        above = (r - horizon) * (r - low_root)
        # Above + outer inner, from their difference of squares where they cancel.
        squares = (
            -2 * (horizon + low_root) * r + horizon**2 + 2 * horizon * low_root - (h * h - d) - 2 * h * next_root
        ) * r
        squares = squares - horizon**2 * low_root + next_root * (h * h - d)
        cancels = outer * inner < -0.5 * above
        gap = jnp.where(cancels, above - outer * inner, 1.0)
        s = jnp.where(cancels, squares / gap, (above + outer * inner) / (r - low_root))
        logs.append(elliptic.log_ratio(s, rate, (r - horizon) / (r - low_root) * pole.p))
        poles.append(pole)
        rates.append(rate)
    first, thirds = elliptic.carlson(triple, poles)
    time = 2 * first
    plus, minus = (log + 2 / 3 * third - rate * time for log, third, rate in zip(logs, thirds, rates, strict=True))
    r_plus, r_minus = _horizons(a)
    return time, -a / (r_plus - r_minus) * (plus - minus)


def _arguments(r: Array, h: Array, d: Array, e: Array, inner: Array, outer: Array) -> elliptic.Triple:
    """The arguments of R_F between r and infinity; inner, outer are the roots of the two factors of R at r.

    outer < 0 for a ray that starts inward. Sums that cancel then are written as quotients.
    """
    inward = outer < 0
    span = jnp.where(inward, inner - outer, 1.0)
    root = jnp.where(inward, (4 * r * h + d - e) / span, outer + inner)
    squares = 2 * r * h * (e + d) - (e - d) * (r * r + h * h)
    span = jnp.where(inward, inner * (r - h) - outer * (r + h), 1.0)
    product = 2 * jnp.where(inward, squares / span, outer * (r + h) + inner * (r - h))
    reach = jnp.where(inward, d / jnp.where(inward, r - h - outer, 1.0), r - h + outer)
    return elliptic.Triple(root, 2 * jnp.sqrt((r + h + inner) * reach), product)


def _horizons(spin: Array) -> tuple[Array, Array]:
    outer = radial.horizon(spin)
    return outer, spin**2 / outer
