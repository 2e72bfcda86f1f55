"""Rays and beams integrated in Mino time, in a form with no singular point.

The path is u = 1/r and a point m = (x, y, z) of the unit sphere that turns about the spin axis by psi:

    u'' = U'(u) / 2,   m'' = a^2 z e_z - (k + 2 a^2 z^2) m,   psi' = -a (2 u - a b u^2) / (1 - 2 u + a^2 u^2).

No first derivative stands on the right, so a Runge-Kutta-Nystroem pair of order 12(10) integrates it. A beam
is the same path with its first variation in two orthonormal directions of the camera sky, in the same steps. A ray
alone takes these steps without the variations, which is less than half of the work; how its errors grow is an estimate
of spread.py. Each ray takes its own steps, from a bound on the rate of change of its solution; a batch runs until its
slowest ray has arrived, so batches should hold rays of similar work (see beams/dispatch.py).

All functions work elementwise on JAX arrays of one shape, one entry a ray.
"""

from functools import partial

import jax
import jax.numpy as jnp

from kerrcaustics.beams.geometry import first_azimuth
from kerrcaustics.beams.integrator import clock
from kerrcaustics.beams.integrator.equations import polar_rapidity, rapidity, rates_with_variation
from kerrcaustics.beams.integrator.journey import Journey, Progress, beam_area, remaining, step
from kerrcaustics.beams.integrator.landing import land
from kerrcaustics.beams.integrator.spread import Ray
from kerrcaustics.beams.ray_end import RayEnd, RayOutputs
from kerrcaustics.beams.ray_state import DENSEST, Aim, Constants, Path
from kerrcaustics.beams.traced_ends import TracedEnd
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.frame import Frame, Photon, photon_of, potential_coefficients
from kerrcaustics.spacetime.sphere import tangent_basis


def survey(frame: Frame, sky: Components, end: TracedEnd) -> Reals:
    """An estimate of the work of each ray, without integrating; 0 for those that do not reach their end."""
    constants, path, photon = start(frame, sky)
    aim = aim_at(end, frame, photon)
    work = aim.mino_time * rapidity(frame.spin, constants, path) * _near_edge(constants, aim.mino_time)
    return jnp.where(aim.lost, 0, work)


def prospects(frame: Frame, sky: Components, end: TracedEnd) -> tuple[Flags, Flags, Flags]:
    """Flags of rays that do not reach their end, that fall in when followed on, and for which both are certain."""
    aim = aim_at(end, frame, photon_of(frame, sky))
    return aim.lost, aim.captured, aim.certain


def trace(
    frame: Frame, sky: Components, refinement: Reals, tolerance: Reals, end: TracedEnd, outputs: RayOutputs
) -> RayEnd[Reals | Flags]:
    """Rays, or beams, followed from camera-sky directions to their end (infinity is u = 0 exactly).

    Parameters: sky, three arrays N_x, N_y, N_z; refinement, steps are shorter by this factor per ray, and 0 leaves
    a ray out; tolerance, the largest error of n' in radians; end, that of the rays; outputs, the quantities beside n'.
    """
    constants, ray, photon = start(frame, sky)
    quartic = radial.factor(frame, photon)
    aim = end.aim(frame, photon, quartic)
    varied, variations = with_variations(frame, sky, ray)
    paths = varied if outputs.beams else varied[:1]
    density = _density(tolerance) * _near_edge(constants, aim.mino_time)
    density = refinement * jnp.minimum(density, DENSEST)
    idle = aim.lost | (refinement <= 0)
    rates = partial(all_rates, frame.spin, constants, variations if outputs.beams else [])
    if outputs.time:
        rates = clock.with_clock(rates, frame.spin, constants)
        paths = (*paths, clock.started(constants, ray))
    arrival = jnp.where(idle, 0.0, aim.mino_time)
    journey = Journey(frame.spin, end, constants, aim, idle, arrival, density, rates)
    first = _departure(journey, paths, first_azimuth(frame, ray.rate), outputs)
    last = jax.lax.while_loop(lambda now: jnp.any(remaining(journey, now) != 0), partial(step, journey), first)
    return land(frame, journey, Ray(sky, photon, quartic), varied, last, beams=outputs.beams)


def _departure(journey: Journey, paths: tuple[Path, ...], azimuth: Reals, outputs: RayOutputs) -> Progress:
    """Rays at the camera."""
    none, (_, _, _, z), z_rate = jnp.zeros_like(journey.arrival), paths[0].position, paths[0].rate[3]
    return Progress(
        time=none,
        steps=none,
        paths=paths,
        local_error=none,
        azimuth=azimuth,
        conjugate_points=none if outputs.index else None,
        area_sign=jnp.sign(beam_area(journey, paths)) if outputs.index else None,
        crossings=none if outputs.crossings else None,
        side=jnp.where(z == 0, jnp.sign(z_rate), jnp.sign(z)) if outputs.crossings else None,
        clock_error=none if outputs.time else None,
        corrections=none if journey.end.finite else None,
    )


def start(frame: Frame, sky: Components) -> tuple[Constants, Path, Photon]:
    """The constants of rays, and the rays and photons at the camera."""
    photon = photon_of(frame, sky)
    a2, a1, a0 = potential_coefficients(frame.spin, photon)
    return Constants(a2, a1, a0, photon.k, photon.b), Path(photon.position, photon.rate, 0 * photon.b), photon


def aim_at(end: TracedEnd, frame: Frame, photon: Photon) -> Aim:
    """The aims of rays."""
    return end.aim(frame, photon, radial.factor(frame, photon))


def with_variations(frame: Frame, sky: Components, ray: Path) -> tuple[tuple[Path, ...], list[Constants]]:
    """The ray with its variations in two orthonormal directions of the camera sky, and those of its constants."""
    starts = []
    for direction in tangent_basis(jnp.stack(sky, axis=-1), jnp):
        tangent = tuple(direction[..., i] for i in range(3))
        starts.append(jax.jvp(lambda *s: start(frame, s)[:2], sky, tangent)[1])
    return (ray, *(path for _, path in starts)), [variation for variation, _ in starts]


def all_rates(
    spin: Reals, constants: Constants, variations: list[Constants], positions: list[tuple[Reals, ...]]
) -> tuple[list[tuple[Reals, ...]], list[Reals]]:
    """Rates of the ray and of its variations."""
    return rates_with_variation(spin, constants, positions[0], list(zip(variations, positions[1:], strict=True)))


def _density(tolerance: Reals) -> Reals:
    """Steps per radian of arc for a tolerance of n'; the power is the order, the factors were measured.

    Crossings of the plane, and conjugate points, lie about half a polar oscillation apart, pi radians of arc: no step
    may hold two. So the steps of the loosest tolerances grow more slowly, up to 2.9 radians.
    """
    return jnp.maximum(1.1 * (1e-10 / tolerance) ** (1 / 12), 0.51 * (1e-6 / tolerance) ** (1 / 24))


def _near_edge(constants: Constants, mino_time: Reals) -> Reals:
    """Shorter steps for rays that circle the hole: their errors grow by about e for every radian of arc."""
    arc = mino_time * polar_rapidity(constants)
    return jnp.exp(jnp.clip(arc - 4, 0, 16) / 11)
