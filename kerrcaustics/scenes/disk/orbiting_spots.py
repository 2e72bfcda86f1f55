"""Hot spots on circular orbits of any inclination: small thin balls of light, seen where rays pass them.

Rays are marched as through a volume. In each step the few balls near a ray are found, by a tree of places about the
time when the light passed, and the light on the way through a ball is added in closed form: in the frame of the
spot, in which it is round, the ray is straight.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.orbits.spherical_orbits import SphericalOrbits, spherical_constants
from kerrcaustics.scenes.colour import ResponseLike, check_response
from kerrcaustics.scenes.disk.spots import FADES
from kerrcaustics.scenes.scene_checks import check_number, not_negative, positive
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import numbers, one_of

if TYPE_CHECKING:
    from scipy.spatial import KDTree

Array = np.ndarray

# Spots are heeded within so many deviations, and are widened to a pixel so many times, at most.
_DEVIATIONS, _WIDEST = 3.5, 6.0
# A step within the spots, in sqrt(size r), before the step of the march.
_SCALE = 1.0
# Of a spot's peak: fainter parts are not lit.
_FAINTEST = 1e-3
# Time between two trees; and of a trace, between two of its moments, in deviations that a spot goes.
_BETWEEN, _TRACE_STEP, _MOST_MOMENTS = 0.5, 2.0, 400
# No orbit is faster at its radius, times sqrt(radius), in coordinate time and of the unit vector times the radius.
_FASTEST = 1.5

_COLUMNS = {"phase": 0.0, "inclination": 0.0, "node": 0.0, "temperature": 6504.0, "brightness": 1.0}


@dataclass(frozen=True, eq=False)
class OrbitingSpots:
    """Round spots, each on a circular orbit of its own, tilted by any angle: balls that glow and hide nothing.

    They take the place of a `Volume` in `render` and `TracedView.show`, whose `time` and `delay` they heed.

    Parameters
    ----------
    radius : (n,) array
        Radii of their orbits.
    phase : float or (n,) array
        Angle of a spot at time 0 along its orbit, from its ascending node.
    inclination : float or (n,) array
        Inclination of the orbit, as its highest latitude, 0 to pi; beyond pi / 2 a spot circles against the spin.
    node : float or (n,) array
        Azimuth of the ascending node at time 0; a hole that spins turns it.
    temperature, brightness : float or (n,) array
        Kelvin, and factors of a spot's light.
    size : float
        Standard deviation of a spot's profile, in units of the mass.
    streak : float
        Time over which a spot leaves a streak that fades; 0 for none.
    response, fade : str
        As for `Spots`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    In its middle a spot is as bright as a black body, from all sides, and its light falls off as a Gaussian. A spot
    smaller than a pixel is widened to it, to six times its size at most, and dimmed accordingly: where pixels are
    coarser than that, as in the images next to the shadow edge, they show grains of light. Orbits may be unstable, as
    within the ISCO.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.disks.OrbitingSpots(radius=[8.0, 9.0], inclination=[0.1, 3.0], size=0.2).size
    0.2
    """

    radius: Any
    phase: Any = 0.0
    inclination: Any = 0.0
    node: Any = 0.0
    temperature: Any = 6504.0
    size: float = 0.1
    streak: float = 0.0
    response: ResponseLike = "cie"
    brightness: Any = 1.0
    fade: str = "linear"

    symmetric: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Raise ValueError unless the spots are valid."""
        radius = numbers("radius", self.radius).ravel()
        if not (len(radius) and np.isfinite(radius).all() and (radius > 0).all()):
            raise ValueError("Argument `radius` must hold positive, finite radii.")
        object.__setattr__(self, "radius", radius)
        for name in _COLUMNS:
            values = numbers(name, getattr(self, name)).ravel()
            if len(values) not in (1, len(radius)) or not np.isfinite(values).all():
                raise ValueError(f"Argument `{name}` must hold one finite number, or {len(radius)}, one for each spot.")
            object.__setattr__(self, name, np.broadcast_to(values, radius.shape))
        if not ((self.inclination >= 0) & (self.inclination <= math.pi)).all():
            raise ValueError("Argument `inclination` must hold angles from 0 to pi.")
        if not ((self.temperature > 0) & (self.temperature <= 1e6)).all() or (self.brightness < 0).any():
            raise ValueError("Arguments `temperature`, `brightness` must hold kelvins to 1e6, and factors from 0 on.")
        check_number("size", self.size, "be a positive, finite length", positive)
        check_number("streak", self.streak, "be a finite time from 0 on", not_negative)
        check_response(self.response)
        one_of("fade", self.fade, FADES)

    @property
    def inner(self) -> float:
        """The radius within which there is nothing."""
        return max(float(self.radius.min()) - self._reach, float(self.radius.min()) / 2)

    @property
    def outer(self) -> float:
        """The radius beyond which there is nothing."""
        return float(self.radius.max()) + self._reach

    @property
    def _reach(self) -> float:
        return _DEVIATIONS * _WIDEST * self.size

    def check(self, spin: float) -> None:
        """Raise ValueError where a hole has no such orbit."""
        energy, *_ = spherical_constants(spin, self.radius, self.inclination)
        wrong = np.flatnonzero(~np.isfinite(energy) | (self.radius <= kerr.horizon(spin)))
        if len(wrong):
            what = f"but one is {self.radius[wrong[0]]:g} at the inclination {self.inclination[wrong[0]]:.6g}"
            raise ValueError(f"Argument `radius` must hold radii of circular orbits, {what}.")

    def orbits(self, spin: float) -> SphericalOrbits:
        """The orbits about a hole, for places at any time: `orbits(spin).places(time)`, with `error` in radians."""
        self.check(spin)
        return SphericalOrbits(spin, self.radius, self.inclination, self.node, self.phase)

    def turned_by(self, angle: float) -> "OrbitingSpots":
        """The spots turned about the spin axis by an angle (radians, toward larger phi)."""
        return replace(self, node=self.node + angle)

    def about(self, spin: float, time: float, delay: bool) -> "Flock":
        """The spots about a hole as the light that arrives at a moment finds them."""
        speed = _FASTEST / math.sqrt(float(self.radius.min()))
        count = math.ceil(self.streak * speed / (_TRACE_STEP * self.size)) if self.streak else 1
        count = min(max(count, 1), _MOST_MOMENTS)
        age = (np.arange(count) + 0.5) / count if self.streak else np.zeros(1)
        share = (1 - age) ** (FADES.index(self.fade) + 1) if self.streak else np.ones(1)
        spot, moment = (part.ravel() for part in np.mgrid[: len(self.radius), :count])
        orbits = self.orbits(spin).part(spot)
        light = self.brightness[spot] * (share / share.sum())[moment]
        return Flock(self, orbits, (self.temperature[spot], light, time - self.streak * age[moment]), delay)


class RayPart(NamedTuple):
    """Places of n rays: u = 1 / r, m (n, 3) with the turn psi, their rates by Mino time, backward; times (n,)."""

    u: Array
    vector: Array
    u_rate: Array
    rate: Array
    late: Array


class Lit(NamedTuple):
    """Light that spots add: ray (k,), in parts of a black body's; kelvin; energy, as of `Volume.energy`; cos theta."""

    ray: Array
    light: Array
    temperature: Array
    energy: Array
    cosine: Array


class Meeting(NamedTuple):
    """Rays near spots, as the spots measure.

    ahead (n,), how far light is past the place next to the spot; the square (n,) of that least distance; -p.u (n,) of
    light of unit energy; stretch (n,), length by Mino time.
    """

    ahead: Array
    apart_2: Array
    energy: Array
    stretch: Array


class Flock:
    """Spots, with the moments of their traces, as the light that arrives at one moment finds them.

    spots; orbits, temperature, light, moment (k,): one for each moment of each trace; delay, as for `render`. What a
    march asks of a volume: rims and a length.
    """

    brightness = 1.0

    def __init__(self, spots: OrbitingSpots, orbits: SphericalOrbits, parts: tuple[Array, Array, Array], delay: bool):
        """Keep them; places at a time are made when rays need them. parts: temperature, light, moment."""
        self.spots, self.orbits, self.delay = spots, orbits, delay
        self.temperature, self.light, self.moment = parts
        self.inner, self.outer, self.size = spots.inner, spots.outer, spots.size
        self._trees: dict[int, KDTree] = {}

    def length(self, radius: Float[Array, " n"], width: ArrayLike) -> Float[Array, " n"]:
        """Length (n,) over which a ray bends by a small part of a spot, or of what it is widened to."""
        return _SCALE * np.sqrt(np.maximum(self.size, np.minimum(width, _WIDEST * self.size)) * radius)

    def shine(self, part_at: Callable[[Array, Array], RayPart], h: Array, width: Array) -> Lit:
        """Light that spots add to n rays in a step h (n,) of Mino time, backward.

        part_at: places of rays with some numbers at parts, 0 to 1, of the step; width (n,) of a pixel's beam.
        """
        size = np.hypot(self.size, np.minimum(width / math.sqrt(12), _WIDEST * self.size))
        from scipy.special import ndtr

        middle = part_at(np.arange(len(h)), np.full(len(h), 0.5))
        speed = np.hypot(middle.u_rate / middle.u, np.linalg.norm(middle.rate, axis=1)) / middle.u
        fastest = _FASTEST / math.sqrt(float(self.orbits.radius.min()))
        drift = fastest * (_BETWEEN / 2 + (h / middle.u**2 if self.delay else 0.0))
        ray, spot = self._near(middle, _DEVIATIONS * size + speed * h / 2 + drift)
        part = np.full(len(ray), 0.5)
        for _ in range(2):
            meeting = self._meeting(part_at(ray, part), spot)
            part = np.clip(part + meeting.ahead / (meeting.stretch * h[ray]), 0, 1)
        at = part_at(ray, part)
        meeting, wide = self._meeting(at, spot), size[ray]
        length = meeting.stretch * h[ray]
        within = ndtr((meeting.ahead + length * part) / wide) - ndtr((meeting.ahead - length * (1 - part)) / wide)
        profile = np.exp(-meeting.apart_2 / wide**2 / 2) * (self.size / wide) ** 2 * within
        lit = np.flatnonzero(profile > _FAINTEST * (self.size / wide) ** 2)
        light = profile[lit] * self.light[spot[lit]]
        return Lit(ray[lit], light, self.temperature[spot[lit]], meeting.energy[lit], at.vector[lit, 2])

    def _meeting(self, at: RayPart, spot: Int[Array, " pairs"]) -> Meeting:
        """Rays as the spots near them measure, in an orthonormal frame of the FIDO there, and in their own."""
        spin, radius = self.orbits.spin, self.orbits.radius[spot]
        place = self.orbits.part(spot).places(self.moment[spot] + (at.late if self.delay else 0.0))
        frames = _FidoFrames.at(spin, radius, place.vector)
        off = frames.lengths(at.vector - place.vector, 1 / at.u - radius)
        speed = frames.velocity(place.rate)
        light = frames.momentum(at)
        clock = place.clock * frames.lapse
        along = (speed * off).sum(axis=0) * clock
        energy = clock * (np.linalg.norm(light, axis=0) - (speed * light).sum(axis=0))
        ahead = (off * light).sum(axis=0) / energy - along
        apart_2 = np.maximum((off**2).sum(axis=0) + along**2 - ahead**2, 0)
        sigma = 1 / at.u**2 + (spin * at.vector[:, 2]) ** 2
        return Meeting(ahead, apart_2, energy, energy * sigma)

    def _near(self, middle: RayPart, reach: Array) -> tuple[Int[Array, " pairs"], Int[Array, " pairs"]]:
        """Rays and spots that may meet in a step; reach (n,), from the middle of a ray's step."""
        place = middle.vector / middle.u[:, None]
        window = np.floor(middle.late / _BETWEEN).astype(int) if self.delay else np.zeros(len(reach), int)
        rays, spots = [np.zeros(0, int)], [np.zeros(0, int)]
        for number in np.unique(window):
            here = np.flatnonzero(window == number)
            near = self._tree(int(number)).query_ball_point(place[here], reach[here], return_sorted=False)
            rays.append(np.repeat(here, [len(some) for some in near]))
            spots += [np.asarray(some, int) for some in near if some]
        return np.concatenate(rays), np.concatenate(spots)

    def _tree(self, number: int) -> "KDTree":
        """The spots in space in the middle of a window of time."""
        if number not in self._trees:
            from scipy.spatial import KDTree

            late = (number + 0.5) * _BETWEEN if self.delay else 0.0
            self._trees[number] = KDTree(self.orbits.places(self.moment + late).vector * self.orbits.radius[:, None])
        return self._trees[number]


class _FidoFrames(NamedTuple):
    """Frames of FIDOs at n places: directions (n, 3) of theta and phi, lengths of units there, sin theta, lapse..."""

    south: Array
    east: Array
    scales: Array
    sine: Array
    sigma: Array
    lapse: Array
    shift: Array

    @classmethod
    def at(cls, spin: float, r: Array, vector: Float[Array, "n 3"]) -> "_FidoFrames":
        """Frames of FIDOs at radii and unit vectors."""
        x, y, z = vector.T
        sine = np.maximum(np.hypot(x, y), 1e-300)
        east = np.stack([-y / sine, x / sine, np.zeros_like(z)], axis=-1)
        south = np.stack([z * x / sine, z * y / sine, -sine], axis=-1)
        sigma, delta = r * r + (spin * z) ** 2, kerr.horizon_product(spin, r)
        big = (r * r + spin**2) ** 2 - spin**2 * delta * sine**2
        scales = np.sqrt(np.stack([sigma / delta, sigma, big / sigma]))
        return cls(south, east, scales, sine, sigma, np.sqrt(sigma * delta / big), 2 * spin * r / big)

    def lengths(self, off: Float[Array, "n 3"], outward: Float[Array, " n"]) -> Float[Array, "3 n"]:
        """A displacement of the unit vector and of the radius."""
        return self.scales * np.stack([outward, (off * self.south).sum(axis=1), (off * self.east).sum(axis=1)])

    def velocity(self, rate: Float[Array, "n 3"]) -> Float[Array, "3 n"]:
        """The velocity of what moves at a constant radius; rate: of its unit vector."""
        return self.lengths(rate - (self.shift * self.sine)[:, None] * self.east, np.zeros_like(self.sine)) / self.lapse

    def momentum(self, at: RayPart) -> Float[Array, "3 n"]:
        """The momentum of light of unit energy at infinity, which comes along a ray."""
        south, east = -(at.rate * self.south).sum(axis=1), -(at.rate * self.east).sum(axis=1)
        outward = at.u_rate / at.u**2 * self.scales[0] ** 2 / self.sigma
        return np.stack([outward, south, east]) / self.scales
