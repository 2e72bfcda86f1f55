"""A ray as a function of the hole, the camera and the direction, to be differentiated by all of them.

A ray is integrated in the smooth variables of integrator/integrated.py, in steps so short that only round-off
remains; its derivatives are those of the steps, and as accurate.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from kerrcaustics.beams.geometry import cross, dot
from kerrcaustics.beams.integrator import clock, integrated
from kerrcaustics.beams.integrator.equations import Constants, horizon_rapidity, rapidity, ray_rates
from kerrcaustics.beams.integrator.nystroem import Path, Positions, Rates, nystroem_step
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Flags, Reals
from kerrcaustics.spacetime.camera import Camera, Velocity
from kerrcaustics.spacetime.frame import Frame, Photon

# Steps per time to the pole of psi, at least; steps in all, for rays that round-off keeps on their way for ever; steps
# onto u = 0, each of which leaves the cube of the rest.
_TO_HORIZON, _MOST_STEPS, _LANDINGS = 2, 2000, 2
# Axes of a camera at rest, or in azimuthal motion.
_AXES = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))

# Of one ray: the camera's spin, radius, inclination, and N.
Arguments = Float[Array, "6"]
_Function = Callable[[Arguments, Any], Array]


class Moving(NamedTuple):
    """A camera's motion: its speed and axes, or an angular velocity in place of the speed.

    named, 1 for an angular velocity; orbits, 1 if that is the one of a circular orbit, else it is 0. All are numbers,
    so that one program serves every camera.
    """

    speed: Any
    axes: Any
    named: Any = 0.0
    orbits: Any = 0.0


def motion_of(velocity: Velocity) -> Moving:
    """The motion that a velocity of `Camera` stands for."""
    if velocity in ("circular", "static"):
        return Moving(0.0, _AXES, 1.0, float(velocity == "circular"))
    # Any place will do.
    frame = Camera(0.0, 10.0, velocity=velocity).frame()
    return Moving(frame.speed, frame.basis)


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


def end(arguments: Arguments, motion: Moving, density: Reals = integrated.DENSEST, *, timed: bool) -> Array:
    """n' of one ray, followed by its time if requested, in `density` steps per radian of arc."""
    spin, radius, inclination, *sky = arguments
    frame = frame_of(spin, radius, inclination, motion)
    size = jnp.sqrt(sum(x * x for x in sky))
    constants, ray, photon = integrated.start(frame, tuple(x / size for x in sky))
    captured, arrival = _aim(*jax.lax.stop_gradient((frame, photon)))
    paths = _path_to_end(spin, constants, ray, arrival, density, timed=timed)
    path = paths[0]
    _, x, y, z = path.position
    c, s = jnp.cos(path.psi), jnp.sin(path.psi)
    parts = [c * x - s * y, s * x + c * y, z]
    if timed:
        parts.append(clock.reading(constants, ray, path, paths[-1], at_infinity=True))
    return jnp.where(captured, jnp.nan, jnp.stack(parts))


def _aim(frame: Frame, photon: Photon) -> tuple[Flags, Reals]:
    """True for captured rays; the Mino time to infinity of the others."""
    quartic = radial.factor(frame, photon)
    captured = radial.is_captured(frame, photon, quartic)
    return captured, jnp.where(captured, 0.0, radial.mino_time(frame, photon, quartic))


def _path_to_end(
    spin: Reals, constants: Constants, ray: Path, arrival: Reals, density: Reals, *, timed: bool
) -> tuple[Path, ...]:
    """The ray, and its clock if requested, at u = 0."""

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
        h = jnp.where(lands, -paths[0].position[0] / paths[0].rate[0], rest / jnp.maximum(jnp.ceil(rest * pace), 1))
        return jnp.where(lands, 0, rest - h), steps + 1, landings + lands, nystroem_step(rates, paths, h)[0]

    def goes_on(now: tuple[Any, ...]) -> Any:
        return (now[2] < _LANDINGS) & (now[1] < _MOST_STEPS)

    return jax.lax.while_loop(goes_on, step, (arrival, 0, 0, paths))[-1]


def frame_of(spin: Any, radius: Any, inclination: Any, motion: Moving) -> Frame:
    """The camera's frame, as `Camera.frame` has it, for numbers that JAX traces."""
    a, r, s, c = spin, radius, jnp.sin(inclination), jnp.cos(inclination)
    sigma = r * r + (a * c) ** 2
    outer = radial.horizon(a)
    delta = (r - outer) * (r - a * a / outer)
    big = (r * r + a * a) ** 2 - a * a * delta * s * s
    lapse, shift, scale = jnp.sqrt(sigma * delta / big), 2 * a * r / big, jnp.sqrt(big / sigma)
    orbital = motion.orbits / (a + r * jnp.sqrt(r))
    speed = motion.speed + motion.named * scale * s * (orbital - shift) / lapse
    numbers: dict[str, Any] = dict(
        spin=a,
        radius=r,
        sin_theta=s,
        cos_theta=c,
        lapse=lapse,
        shift=shift,
        cylindrical_scale=scale,
        root_sigma=jnp.sqrt(sigma),
        root_sigma_delta=jnp.sqrt(sigma * delta),
        speed=speed,
        slowness=(1 - speed) * (1 + speed),
        basis=motion.axes,
        zoom=1.0,
        start=r + 2 * jnp.log(r),
    )
    return Frame(**numbers)


def expansion(arguments: Float[Array, "rays 6"], motion: Moving, density: Reals) -> tuple[Array, Array]:
    """n', time and det J of rays (rays, 5), and their derivatives by the arguments (rays, 5, 6)."""

    def values(ray: Arguments) -> tuple[Array, Array]:
        def whole(ray: Arguments) -> tuple[Array, Array]:
            end_values = end(ray, motion, density, timed=True)
            return end_values, end_values

        columns, end_values = jax.jacfwd(whole, has_aux=True)(ray)
        numbers = jnp.append(end_values, _determinant(end_values[:3], ray[3:], columns[:3, 3:]))
        return numbers, numbers

    columns, numbers = jax.vmap(jax.jacfwd(values, has_aux=True))(arguments)
    return numbers, columns


def _determinant(n: Array, sky: Array, slopes: Array) -> Reals:
    """det J from the derivatives of n' by the unit vector N: the matrix of their cofactors is det J n' N."""
    x, y, z = (tuple(slopes[:, i]) for i in range(3))
    pairs = ((y, z), (z, x), (x, y))
    return sum(sky[i] * dot(tuple(n), cross(*pair)) for i, pair in enumerate(pairs))
