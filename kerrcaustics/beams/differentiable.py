"""A ray as a function of the hole, the viewer and the direction, to be differentiated by all of them.

A ray is integrated in the smooth variables of integrator/integrated.py, in steps so short that only round-off
remains; its derivatives are those of the steps, and as accurate. It arrives at an implicit event: the computed arrival
is a number without derivatives, and the last steps are Newton's onto the surface. Each of them, as it squares the rest
or better, makes twice as many orders of derivatives right.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from kerrcaustics.beams.integrator import clock, integrated
from kerrcaustics.beams.integrator.equations import horizon_rapidity, rapidity, ray_rates
from kerrcaustics.beams.integrator.nystroem import Positions, Rates, nystroem_step
from kerrcaustics.beams.moving import Moving
from kerrcaustics.beams.ray_state import DENSEST, Aim, Constants, Path
from kerrcaustics.beams.traced_ends import TracedEnd, TracedSky
from kerrcaustics.beams.vectors import cross, dot
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.arrays import Components, Reals
from kerrcaustics.spacetime.frame import Frame
from kerrcaustics.spacetime.observer import SCREEN, sphere_parts

# Least number of steps per time to the pole of psi.
_TO_HORIZON = 2
# Most steps in all: round-off keeps some rays on their way for ever.
_MOST_STEPS = 2000
# Steps onto a surface at infinity, where each leaves the cube of the rest.
_LANDINGS = 2
# Steps onto a finite surface.
_FINITE_LANDINGS = 3
# Of one ray: the viewer's spin, radius, inclination, and N, or (alpha, beta) of an observer.
Arguments = Float[Array, "numbers"]
_Function = Callable[[Arguments, Any], Array]


@contextmanager
def float64() -> Iterator[None]:
    """Float64, and NumPy's rules; captured rays are NaN. Other settings of the caller, who may be tracing, hold."""
    with ExitStack() as changed:
        changed.enter_context(jax.enable_x64(True))
        changed.enter_context(jax.debug_nans(False))
        changed.enter_context(jax.numpy_dtype_promotion("standard"))
        changed.enter_context(jax.numpy_rank_promotion("allow"))
        yield


def differentiable(function: _Function) -> _Function:
    """A function of one array and a motion; its derivatives by the array are columns by forward differentiation.

    So they are in every mode and order.
    """

    @jax.custom_jvp
    def smooth(arguments: Arguments, motion: Moving) -> Array:
        with float64():
            return function(arguments, motion)

    @smooth.defjvp
    def _slope(primals: tuple[Arguments, Moving], tangents: tuple[Arguments, Moving]) -> tuple[Array, Array]:
        with float64():
            columns = differentiable(jax.jacfwd(function))(*primals)
            # Not a product of matrices, whose transpose would be made under the caller's settings.
            return smooth(*primals), jnp.sum(columns * tangents[0], axis=-1)

    return smooth


class Arrival(NamedTuple):
    """The end of one ray: n', 1 / r, and the time; NaN for rays that do not reach it."""

    direction: Array
    u: Reals
    time: Reals


def end(arguments: Arguments, motion: Moving, density: Reals = DENSEST, *, timed: bool) -> Array:
    """n' of one ray that escapes, followed by its time if requested, in `density` steps per radian of arc."""
    ray_end = arrival(arguments, motion, TracedSky(), density, timed=timed)
    return jnp.append(ray_end.direction, ray_end.time) if timed else ray_end.direction


def arrival(arguments: Arguments, motion: Moving, surface: TracedEnd, density: Reals, *, timed: bool) -> Arrival:
    """The end of one ray on a surface, in `density` steps per radian of arc; the time, if requested, else NaN."""
    spin, radius, inclination, *sky = arguments
    on_screen = len(sky) == 2
    frame = frame_of(spin, radius, inclination, motion, on_screen=on_screen)
    constants, ray, photon = integrated.start(frame, _direction(sky))
    aim = integrated.aim_at(surface, *jax.lax.stop_gradient((frame, photon)))
    paths = _path_to_end(spin, constants, ray, (surface, aim), density, timed=timed)
    path = paths[0]
    u, x, y, z = path.position
    c, s = jnp.cos(path.psi), jnp.sin(path.psi)
    time = jnp.nan
    if timed:
        far = not surface.finite
        time = clock.reading(constants, ray, path, paths[-1], at_infinity=far, distant=on_screen)
    ray_end = Arrival(jnp.stack([c * x - s * y, s * x + c * y, z]), u, time)
    lost = surface.lost(aim, spin, u)
    return Arrival(*(jnp.where(lost, jnp.nan, part) for part in ray_end))


def _direction(sky: list[Reals]) -> Components:
    """The direction, as engines take it, of N of any length, or of (alpha, beta)."""
    if len(sky) == 2:
        return sphere_parts(*sky)
    x, y, z = sky
    size = jnp.sqrt(x * x + y * y + z * z)
    return x / size, y / size, z / size


def _path_to_end(
    spin: Reals, constants: Constants, ray: Path, goal: tuple[TracedEnd, Aim], density: Reals, *, timed: bool
) -> tuple[Path, ...]:
    """The ray, and its clock if requested, on a surface that it is aimed at."""
    surface, aim = goal
    most_landings = _FINITE_LANDINGS if surface.finite else _LANDINGS

    def of_ray(positions: Positions) -> tuple[Positions, list[Reals]]:
        acceleration, psi_rate = ray_rates(spin, constants, positions[0])
        return [acceleration], [psi_rate]

    rates: Rates = of_ray
    paths: tuple[Path, ...] = (ray,)
    if timed:
        rates = clock.with_clock(rates, spin, constants)
        paths = (*paths, clock.started(constants, ray))

    def step(now: tuple[Any, ...]) -> tuple[Any, ...]:
        rest, steps, landings, paths = now
        state = jax.lax.stop_gradient((spin, constants, paths[0]))
        pace = jnp.maximum(density * rapidity(*state), _TO_HORIZON * horizon_rapidity(*state))
        lands = rest <= 0
        left = surface.time_left(constants, aim, paths[0])
        h = jnp.where(lands, left, rest / jnp.maximum(jnp.ceil(rest * pace), 1))
        return jnp.where(lands, 0, rest - h), steps + 1, landings + lands, nystroem_step(rates, paths, h)[0]

    def goes_on(now: tuple[Any, ...]) -> Any:
        return (now[2] < most_landings) & (now[1] < _MOST_STEPS)

    return jax.lax.while_loop(goes_on, step, (aim.mino_time, 0, 0, paths))[-1]


def frame_of(spin: Any, radius: Any, inclination: Any, motion: Moving, *, on_screen: bool = False) -> Frame:
    """The viewer's frame, as `Camera.frame`, or on a screen `Observer.frame`, has it, for numbers that JAX traces."""
    a, r, s, c = spin, radius, jnp.sin(inclination), jnp.cos(inclination)
    sigma = r * r + (a * c) ** 2
    delta = kerr.horizon_product(a, r)
    big = (r * r + a * a) ** 2 - a * a * delta * s * s
    lapse, shift, scale = jnp.sqrt(sigma * delta / big), 2 * a * r / big, jnp.sqrt(big / sigma)
    zoom = SCREEN / r if on_screen else 1.0
    ahead = motion.orbits * _orbital(a, r, delta, big) + (1 - motion.orbits) * -shift
    speed = motion.speed + motion.named * scale * s * ahead / lapse
    numbers: dict[str, Any] = dict(
        spin=a,
        radius=r,
        sin_theta=s,
        cos_theta=c,
        lapse=lapse,
        shift=shift,
        cylindrical_scale=zoom * scale,
        root_sigma=jnp.sqrt(sigma),
        root_sigma_delta=jnp.sqrt(sigma * delta),
        speed=speed,
        slowness=(1 - speed) * (1 + speed),
        basis=motion.axes,
        zoom=zoom,
        start=0.0 if on_screen else r + 2 * jnp.log(r),
    )
    return Frame(**numbers)


def _orbital(a: Any, r: Any, delta: Any, big: Any) -> Any:
    """The angular velocity of the circular orbit, less that of the FIDO at a place where `big` is A of JTFT A.1.

    That in the plane, which does not cancel, and its change up to there.
    """
    level = (r * r + a * a) ** 2 - a * a * delta
    in_plane = kerr.circular_speed(a, r, delta) * jnp.sqrt(delta) * r * r / level
    return in_plane + 2 * a * r * (big - level) / (big * level)


def expansion(
    arguments: Float[Array, "rays numbers"], motion: Moving, surface: TracedEnd, density: Reals
) -> tuple[Array, Array]:
    """Place, time and det J of rays (rays, 5), and their derivatives by the arguments (rays, 5, numbers).

    The place is n' on a sphere, r n' in the plane; det J, up to its sign there, as `Beams.jacobian` has it.
    """

    def values(ray: Arguments) -> tuple[Array, Array]:
        def timed_end(ray: Arguments) -> tuple[Array, tuple[Array, Array]]:
            ray_end = arrival(ray, motion, surface, density, timed=True)
            place, normal = _on_surface(surface, ray_end)
            end_values = jnp.append(place, ray_end.time)
            return end_values, (end_values, normal)

        columns, (end_values, normal) = jax.jacfwd(timed_end, has_aux=True)(ray)
        numbers = jnp.append(end_values, _determinant(normal, ray[3:], columns[:3, 3:]))
        return numbers, numbers

    columns, numbers = jax.vmap(jax.jacfwd(values, has_aux=True))(arguments)
    return numbers, columns


def _on_surface(surface: TracedEnd, ray_end: Arrival) -> tuple[Array, Array]:
    """The place of an end as a vector that moves within the surface, and the normal there."""
    if surface.in_plane:
        return ray_end.direction / ray_end.u, jnp.array([0.0, 0.0, 1.0])
    return ray_end.direction, ray_end.direction


def _determinant(normal: Array, sky: Array, slopes: Array) -> Reals:
    """det J from the derivatives of the place by N: the matrix of their cofactors is det J normal N.

    On a screen from those by alpha and beta.
    """
    if len(sky) == 2:
        return dot(tuple(normal), cross(tuple(slopes[:, 0]), tuple(slopes[:, 1])))
    x, y, z = (tuple(slopes[:, i]) for i in range(3))
    pairs = ((y, z), (z, x), (x, y))
    return sum(sky[i] * dot(tuple(normal), cross(*pair)) for i, pair in enumerate(pairs))
