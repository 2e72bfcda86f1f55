"""The first variation of a ray in closed form: no more than the integrals that the ray itself needs, and D below.

The constants b, q, k = q + b^2, kappa = q + (b - a)^2 change with the direction, and with them, at a fixed end, Mino
time and azimuth. By Hermite's reduction no integral of the third kind is in these changes.

Radial part. With P = r^2 + a^2 - a b the potential is R = P^2 - Delta kappa; [X] is the integral of X dr / R^(3/2).

    dT = [Y], Y = a P db + Delta dkappa / 2;    dpsi = a [Y - X], X = P dkappa / 2 + a kappa db.

[X] is the change of T for other changes of the coefficients of R. So the slopes of T by these, and by the rates at both
ends, are all that is needed. T is one R_F, with slopes that are sums of one sign. The rates are redundant; with them
nothing is divided by what vanishes at a turning point: for X they change by (P dr' + a r' db) / Delta.

Polar part. With c = k - a^2, rho = c^2 + 4 a^2 q, m_z = z, D the integral of z^2 over Mino time tau,

    dz = L z' + e1 z + e3 z^3,    d(m_x + i m_y) = (L - i eta) (m_x + i m_y)' + (m_x + i m_y) [eta b + e3 z^2 + i g],
    e3 = a^2 c B,  e1 = eta b - e3,    B = (dq / (2 q) - dk / c) / rho,
    eta = (c b dq / (2 q) - (2 a^2 + c) db) / rho,
    L = L0 + a^2 B (2 q tau - c D) + dk tau / (2 c),
    g = g0 + [b dq + (c - 2 q) db] a^2 tau / rho - a^2 eta D,

where L0 and g0 make both vanish at the camera. This is regular on the axis, at turning points, and, since z has the
factor `lift` by which B and eta are multiplied here, in the equatorial plane.

References: Hermite's reduction: Byrd & Friedman 1971, 230. DLMF 19.25, 22.16. All checked against forward
differentiation and long arithmetic.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.closed_form.polar_motion import Polar, PolarRates
from kerrcaustics.beams.closed_form.radial_motion import RadialRoots, Travel, start_of
from kerrcaustics.beams.ray_state import Jacobian, Row
from kerrcaustics.beams.traced_ends import TracedEnd
from kerrcaustics.spacetime import elliptic, radial
from kerrcaustics.spacetime.arrays import Components, Reals
from kerrcaustics.spacetime.frame import Frame, Photon, photon_of
from kerrcaustics.spacetime.sphere import tangent_parts

# Beyond this kappa changes of R are taken about r = 0, not about h.
_MOST_KAPPA = 30.0


class Way(NamedTuple):
    """A ray from the camera to its end: the factors of R, both motions; n' and the radius at the end."""

    quartic: radial.Quartic
    travel: Travel
    polar: Polar
    direction: Components
    radius: Reals


class _Change(NamedTuple):
    """A change of the photon at the camera; p_theta and p_phi are those of an orthonormal basis, times r or so."""

    p_theta: Reals
    p_phi: Reals
    u_rate: Reals
    b: Reals
    k: Reals
    kappa: Reals
    q: Reals


class _TimeSlopes(NamedTuple):
    """Derivatives of the Mino time between two radii, and the point p of the coefficients.

    level, tilt, bend: by the coefficients of (r - p)^0, (r - p)^1, (r - p)^2 of a change of R, with p - 1 = lift;
    u_rate, end_rate: by the rates of u at both ends, as if they were independent of that.
    """

    p: Reals
    lift: Reals
    level: Reals
    tilt: Reals
    bend: Reals
    u_rate: Reals
    end_rate: Reals


class _Course(NamedTuple):
    """The end of the polar motion: sin(theta) and cos(theta), the rates along e_theta and e_phi, Mino time."""

    sine: Reals
    cosine: Reals
    v_theta: Reals
    v_phi: Reals
    time: Reals
    rates: PolarRates


def columns(
    frame: Frame, sky: Components, photon: Photon, way: Way, end: TracedEnd, *, on_equator: bool
) -> tuple[Jacobian, Row]:
    """The changes of the angles (theta', phi'), rows, and of the radius of the end with N along both tangents there."""
    slopes = _time_slopes(frame, photon, way, end)
    course = _course(way)
    changes = []
    for change in _changes(frame, sky):
        swung, along, across = _swung(frame, photon, course, change, on_equator=on_equator)
        delay = -swung if end.in_plane else None
        delay, turned, in_radius = _travelled(frame, photon, way, slopes, change, delay)
        theta = (swung + delay) * course.v_theta + along
        phi = delay * course.v_phi + across + course.sine * turned
        changes.append((theta, phi, in_radius))
    theta, phi, in_radius = zip(*changes, strict=True)
    return (theta, phi), in_radius


def _changes(frame: Frame, sky: Components) -> list[_Change]:
    """The changes of a photon with N along the two tangents of `tangent_basis`."""
    a, s, c = frame.spin, frame.sin_theta, frame.cos_theta

    def momenta(x: Reals, y: Reals, z: Reals) -> Components:
        u_rate, x_rate, y_rate, z_rate = photon_of(frame, (x, y, z)).rate
        return s * z_rate - c * x_rate, -y_rate, u_rate

    (p_theta, p_phi, _), vary = jax.linearize(momenta, *sky)
    changes = []
    for tangent in tangent_parts(*sky, jnp):
        d_theta, d_phi, u_rate = vary(*tangent)
        along = 2 * p_theta * d_theta
        changes.append(
            _Change(
                d_theta,
                d_phi,
                u_rate,
                b=s * d_phi,
                k=along + 2 * p_phi * d_phi,
                kappa=along + 2 * (p_phi - a * s) * d_phi,
                q=along + 2 * c * c * p_phi * d_phi,
            )
        )
    return changes


def _time_slopes(frame: Frame, photon: Photon, way: Way, end: TracedEnd) -> _TimeSlopes:
    """The slopes, by the chain rule from those of R_F, and by the factors of R from those by its roots."""
    roots, start = start_of(frame, photon, way.quartic)

    def arguments(roots: RadialRoots, u_rate: Reals, end_rate: Reals) -> tuple[elliptic.Triple, Reals]:
        first = _place(roots, start.r, u_rate)
        if not end.finite:
            return radial.to_infinity(roots.quartic(), *first), jnp.ones_like(u_rate)
        return radial.carlson_arguments(roots.quartic(), first, _place(roots, way.radius, end_rate))

    end_rate = way.travel.rate + jnp.zeros_like(photon.k)
    (triple, scale), pull = jax.vjp(arguments, roots, photon.rate[0], end_rate)
    first, by = elliptic.first_slopes(triple)
    by_roots, u_rate, end_rate = pull((elliptic.Triple(*(2 * scale * slope for slope in by)), 2 * first))
    about_h = photon.kappa < _MOST_KAPPA
    near, far = _by_coefficients(roots, by_roots), _by_coefficients_about_zero(frame.spin, photon, roots, by_roots)
    level, tilt, bend = (jnp.where(about_h, x, y) for x, y in zip(near, far, strict=True))
    p, lift = jnp.where(about_h, roots.h, 0.0), jnp.where(about_h, roots.lift, -1.0)
    return _TimeSlopes(p, lift, level, tilt, bend, u_rate, end_rate)


def _place(roots: RadialRoots, r: Reals, u_rate: Reals) -> tuple[Reals, Reals, Reals]:
    inner = jnp.sqrt((r - roots.low) * (r - roots.next))
    return r, inner, -u_rate * r**2 / inner


def _by_coefficients(roots: RadialRoots, by: RadialRoots) -> tuple[Reals, Reals, Reals]:
    """Derivatives by the coefficients of R about h, from those by its factors (r - h)^2 - d and (r + h)^2 - e."""
    h, d = roots.h, roots.d
    by_h, by_d, by_e = _by_factors(roots, by)
    by_h = by_h - 4 * h * by_e
    by_d = by_d - by_e
    total = 4 * h * h - (roots.low + h) ** 2 + d
    inverse = 1 / (total**2 - 16 * h * h * d)
    level = (2 * h * by_h - total * by_d) * inverse
    return level, (4 * h * d * by_d - total / 2 * by_h) * inverse, d * level - by_e


def _by_coefficients_about_zero(
    spin: Reals, photon: Photon, roots: RadialRoots, by: RadialRoots
) -> tuple[Reals, Reals, Reals]:
    """The same about r = 0, by way of the resolvent: for distant cameras.

    There the inner root of each pair is close to zero, and what moves these two alone cancels.
    """
    h = roots.h
    by_h, by_d, by_e = _by_factors(roots, by)
    product = h * h - roots.d
    excess = (roots.low + h) ** 2 - h * h
    by_d = by_d + by_e * excess / product
    by_h = by_h + by_d * (photon.kappa / (2 * h * h) - 2 * h) + 2 * h * by_e * (1 - excess / product)
    z, a2, a0 = 4 * h * h, spin**2 - photon.k, -(spin**2) * photon.q
    by_h = by_h / ((z + a2) * (3 * z + a2) - 4 * a0)
    level = 2 * h * by_h - by_e / product
    return level, (by_h * photon.kappa * 2 - by_d) / (4 * h), -by_d / 2 - h * (z + a2) * by_h


def _by_factors(roots: RadialRoots, by: RadialRoots) -> tuple[Reals, Reals, Reals]:
    """Derivatives by h, d and e, from those by the roots: low and next are -h -+ sqrt(e)."""
    return by.h + by.lift - by.low - by.next, by.d, (by.next - by.low) / (roots.next - roots.low)


def _travelled(
    frame: Frame, photon: Photon, way: Way, slopes: _TimeSlopes, change: _Change, delay: Reals | None
) -> tuple[Reals, Reals, Reals]:
    """The changes of Mino time, psi and radius at the end: at a fixed radius, or with the change of the time given."""
    a, b = frame.spin, photon.b
    time, psi = _at_fixed_rates(frame, photon, slopes, change)
    if way.travel.clearance is None:
        return time, psi, jnp.zeros_like(psi)
    u, end_rate, psi_rate = way.travel.u, way.travel.rate, way.travel.psi_rate
    horizon = radial.horizon_function(frame.spin, u)
    force = u * u * (a * (1 + a * (a - b) * u * u) * change.b + horizon * change.kappa / 2)
    psi = psi - a * a * slopes.end_rate * end_rate * u * u / horizon * change.b
    if delay is None:
        more = -slopes.end_rate * force / end_rate
        return time + more, psi + psi_rate * more, jnp.zeros_like(psi)
    more = delay - time
    return delay, psi + psi_rate * more, -(end_rate * more + slopes.end_rate * force) / (u * u)


def _at_fixed_rates(frame: Frame, photon: Photon, slopes: _TimeSlopes, change: _Change) -> tuple[Reals, Reals]:
    """The changes of Mino time and psi, without the parts by the changes of radius and rate at the end."""
    a, kappa, db, dkappa = frame.spin, photon.kappa, change.b, change.kappa
    p, lift = slopes.p, slopes.lift
    # 2 - a b, and P and Delta at p.
    slip = radial.slip(frame, photon)
    room = (1 - a) * (1 + a)
    total, delta = lift * (lift + 2) + slip - room, lift * lift - room
    time = -slopes.level * (2 * a * total * db + delta * dkappa) + slopes.u_rate * change.u_rate
    time = time - slopes.tilt * (4 * a * p * db + 2 * lift * dkappa) - slopes.bend * change.k
    rate = _rate_of_turn(frame, photon, slip, change)
    turn = slopes.level * ((2 * lift + slip) * dkappa - 2 * a * (total - kappa) * db) + slopes.u_rate * rate
    turn = turn + slopes.tilt * (2 * dkappa - 4 * a * p * db) - 2 * a * slopes.bend * db
    return time, a * turn


def _rate_of_turn(frame: Frame, photon: Photon, slip: Reals, change: _Change) -> Reals:
    """The change of the rate at the camera that X stands for, less that of the rate itself.

    Next to the horizon its two parts cancel, all but Delta: there it follows from the change of R.
    """
    a, u_rate, db = frame.spin, photon.rate[0], change.b
    delta = (frame.root_sigma_delta / frame.root_sigma) ** 2
    rest = 2 * (frame.radius - 1) + slip
    total = rest + delta
    close = 2 * delta * photon.kappa < total * total
    near = (photon.kappa * a * db + total * change.kappa / 2) / (frame.radius**4 * jnp.where(close, u_rate, 1.0))
    return jnp.where(close, near + change.u_rate, -(rest * change.u_rate + a * u_rate * db) / delta)


def _course(way: Way) -> _Course:
    assert way.polar.rates is not None
    x, y, z = way.direction
    sine = jnp.sqrt(x * x + y * y)
    on_axis = sine == 0
    inverse = 1 / jnp.where(on_axis, 1.0, sine)
    # In the limit along phi' = 0, as `polar_basis` has it on the axis.
    cos_phi, sin_phi = jnp.where(on_axis, 1.0, x * inverse), y * inverse
    turn = way.travel.psi + way.polar.turn
    c, s = jnp.cos(turn), jnp.sin(turn)
    x_rate, y_rate, z_rate = way.polar.rates.rate
    x_rate, y_rate = c * x_rate - s * y_rate, s * x_rate + c * y_rate
    v_theta = z * (cos_phi * x_rate + sin_phi * y_rate) - sine * z_rate
    return _Course(sine, z, v_theta, cos_phi * y_rate - sin_phi * x_rate, way.travel.time, way.polar.rates)


def _swung(
    frame: Frame, photon: Photon, course: _Course, change: _Change, *, on_equator: bool
) -> tuple[Reals, Reals, Reals]:
    """L of the module's formula; the changes along e_theta, but for L, and along e_phi, but for dpsi.

    In the latter L0 and g0 are taken together: of rays that hardly leave the equatorial plane both are large.
    """
    a2, b, q, p_phi = frame.spin**2, photon.b, photon.q, -photon.rate[2]
    c, rho, time, lift = photon.k - a2, course.rates.rho, course.time, course.rates.lift
    lifted = change.p_theta if on_equator else change.q / (2 * lift)
    own = (lifted - lift * change.k / c) / rho
    # eta has the factor sin(theta) of the camera.
    eta = (c * p_phi * lifted - lift * (2 * a2 + c) * change.p_phi) / rho
    later = own * lift * (2 * a2 * time - c * course.rates.slow) + change.k * time / (2 * c)
    turned = (2 * lift * (b * lifted - lift * change.b) + c * change.b) * a2 * time / rho
    start, starting = 0.0, 0.0
    if not on_equator:
        s0, z0 = frame.sin_theta, frame.cos_theta
        p_theta = s0 * photon.rate[3] - z0 * photon.rate[1]
        start = -z0 * ((rho - 2 * a2 * q + a2 * c * z0**2) * change.p_theta - c / 2 * change.k * p_theta) / (q * rho)
        sine, cosine = course.sine, course.cosine
        apart = jnp.where(
            jnp.abs(cosine) + abs(z0) < sine + s0, (z0 - cosine) * (z0 + cosine), (sine - s0) * (sine + s0)
        )
        # b is s0 p_phi, and - sin(theta) v_phi at the end: next to the axis that, which the basis there turns as well.
        over = jnp.where(
            sine < s0, -course.v_phi / jnp.where(s0 == 0, 1.0, s0), p_phi / jnp.where(sine == 0, 1.0, sine)
        )
        starting = start * apart * over
        turned = turned - eta * z0 * p_theta / lift
    eta = frame.sin_theta * eta
    turned = turned - course.rates.slow * lift * eta
    tipped = course.rates.height * eta
    along = tipped * course.v_phi + course.sine * course.rates.height * a2 * c * own
    across = later * course.v_phi + starting + course.sine * turned - tipped * course.v_theta
    return later + frame.sin_theta * start, along, across
