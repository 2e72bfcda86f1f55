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

# Radius of a spot, in standard deviations, beyond which its light is left out.
_DEVIATIONS = 3.5
# Largest factor by which a spot is widened to a pixel.
_WIDEST = 6.0
# Length of a step among the spots, in sqrt(size r), before the factor of the march.
_SCALE = 1.0
# Part of a spot's peak below which its light is left out.
_FAINTEST = 1e-3
# Time between two search trees, M.
_BETWEEN = 0.5
# Length of the path between two moments of a streak, standard deviations of a spot.
_STREAK_STEP = 2.0
# Largest number of moments of a streak.
_MOST_MOMENTS = 400
# Upper limit of the coordinate speed of circular orbits, times sqrt(radius).
_FASTEST = 1.5

_COLUMNS = {"phase": 0.0, "inclination": 0.0, "node": 0.0, "temperature": 6504.0, "brightness": 1.0}


@dataclass(frozen=True, eq=False)
class OrbitingSpots:
    """Round spots, each on a circular orbit of its own, tilted by any angle: balls that glow and hide nothing.

    They take the place of a `Volume` in `render` and `TracedView.show`, and depend on `time` and `delay`.

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
    smaller than a pixel is widened to it, to six times its size at most, and dimmed accordingly. Coarser
    pixels, as in the images next to the shadow edge, show grains of light. Orbits may be unstable, as
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
        """Radius of the inner end of the matter."""
        return max(float(self.radius.min()) - self._reach, float(self.radius.min()) / 2)

    @property
    def outer(self) -> float:
        """Radius of the outer end of the matter."""
        return float(self.radius.max()) + self._reach

    @property
    def _reach(self) -> float:
        return _DEVIATIONS * _WIDEST * self.size

    def check(self, spin: float) -> None:
        """Raise ValueError unless the hole has these orbits."""
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

    def traces(self, spin: float, time: float, delay: bool) -> "SpotTraces":
        """The spots and their streaks about a hole, for light that arrives at a time."""
        speed = _FASTEST / math.sqrt(float(self.radius.min()))
        count = math.ceil(self.streak * speed / (_STREAK_STEP * self.size)) if self.streak else 1
        count = min(max(count, 1), _MOST_MOMENTS)
        age = (np.arange(count) + 0.5) / count if self.streak else np.zeros(1)
        share = (1 - age) ** (FADES.index(self.fade) + 1) if self.streak else np.ones(1)
        spot, moment = (part.ravel() for part in np.mgrid[: len(self.radius), :count])
        orbits = self.orbits(spin).part(spot)
        light = self.brightness[spot] * (share / share.sum())[moment]
        return SpotTraces(self, orbits, (self.temperature[spot], light, time - self.streak * age[moment]), delay)


class RayPart(NamedTuple):
    """Places of n rays.

    u: (n,) 1 / r.
    vector: (n, 3) unit vectors m, turned by psi.
    u_rate: (n,) derivative of u by Mino time, backward.
    rate: (n, 3) derivative of the unit vector by Mino time, backward.
    delay: (n,) coordinate time of light relative to the camera's, M, negative.
    """

    u: Array
    vector: Array
    u_rate: Array
    rate: Array
    delay: Array


class SpotLight(NamedTuple):
    """Light that spots add to rays, one entry for each pair of a ray and a spot.

    ray: (k,) number of the ray.
    light: (k,) light as a part of a black body's.
    temperature: (k,) temperature of the spot, kelvin.
    energy: (k,) energy of the photon, as of `Volume.energy`.
    cosine: (k,) cos theta of the place.
    """

    ray: Array
    light: Array
    temperature: Array
    energy: Array
    cosine: Array


class ClosestApproach(NamedTuple):
    """The closest approach of rays to spots, as the spots measure.

    ahead: (n,) length from the closest approach to the place of the light, M.
    distance_2: (n,) square of the distance at the closest approach, M^2.
    energy: (n,) -p.u of light of unit energy at infinity.
    stretch: (n,) length of the ray per Mino time.
    """

    ahead: Array
    distance_2: Array
    energy: Array
    stretch: Array


class SpotTraces:
    """Spots and their streaks at one time of the camera: each streak is a row of fainter spots at earlier moments.

    For a march they stand in for a volume: they have rims, a length and a brightness.

    Attributes
    ----------
    spots : OrbitingSpots
    orbits : SphericalOrbits
        Orbits of the k moments of all streaks.
    temperature, light, moment : (k,) arrays
        Kelvin, factor of the light, and coordinate time at the camera.
    delay : bool
        As for `render`.
    """

    brightness = 1.0

    def __init__(self, spots: OrbitingSpots, orbits: SphericalOrbits, parts: tuple[Array, Array, Array], delay: bool):
        """Parameters: parts, the temperatures, lights and moments."""
        self.spots, self.orbits, self.delay = spots, orbits, delay
        self.temperature, self.light, self.moment = parts
        self.inner, self.outer, self.size = spots.inner, spots.outer, spots.size
        self._trees: dict[int, KDTree] = {}

    def length(self, radius: Float[Array, " n"], width: ArrayLike) -> Float[Array, " n"]:
        """Length (n,) over which a ray bends by a small part of a spot's size, after widening."""
        return _SCALE * np.sqrt(np.maximum(self.size, np.minimum(width, _WIDEST * self.size)) * radius)

    def shine(self, part_at: Callable[[Array, Array], RayPart], h: Array, width: Array) -> SpotLight:
        """Light that spots add to n rays in a step h (n,) of Mino time, backward.

        part_at: places of rays, by their numbers, at parts of the step from 0 to 1.
        width: (n,) widths of the pixels' beams, M.
        """
        size = np.hypot(self.size, np.minimum(width / math.sqrt(12), _WIDEST * self.size))
        from scipy.special import ndtr

        middle = part_at(np.arange(len(h)), np.full(len(h), 0.5))
        speed = np.hypot(middle.u_rate / middle.u, np.linalg.norm(middle.rate, axis=1)) / middle.u
        fastest = _FASTEST / math.sqrt(float(self.orbits.radius.min()))
        drift = fastest * (_BETWEEN / 2 + (h / middle.u**2 if self.delay else 0.0))
        ray, spot = self._nearby_pairs(middle, _DEVIATIONS * size + speed * h / 2 + drift)
        part = np.full(len(ray), 0.5)
        for _ in range(2):
            approach = self._closest_approach(part_at(ray, part), spot)
            part = np.clip(part + approach.ahead / (approach.stretch * h[ray]), 0, 1)
        place = part_at(ray, part)
        approach, wide = self._closest_approach(place, spot), size[ray]
        length = approach.stretch * h[ray]
        within = ndtr((approach.ahead + length * part) / wide) - ndtr((approach.ahead - length * (1 - part)) / wide)
        profile = np.exp(-approach.distance_2 / wide**2 / 2) * (self.size / wide) ** 2 * within
        bright = np.flatnonzero(profile > _FAINTEST * (self.size / wide) ** 2)
        light = profile[bright] * self.light[spot[bright]]
        return SpotLight(
            ray[bright], light, self.temperature[spot[bright]], approach.energy[bright], place.vector[bright, 2]
        )

    def _closest_approach(self, ray: RayPart, spot: Int[Array, " pairs"]) -> ClosestApproach:
        """The closest approach of rays to spots, in the orthonormal frame of the FIDO and then in that of the spot."""
        spin, radius = self.orbits.spin, self.orbits.radius[spot]
        place = self.orbits.part(spot).places(self.moment[spot] + (ray.delay if self.delay else 0.0))
        frames = _FidoFrames.at_places(spin, radius, place.vector)
        offset = frames.lengths(ray.vector - place.vector, 1 / ray.u - radius)
        speed = frames.velocity(place.rate)
        light = frames.momentum(ray)
        clock = place.clock * frames.lapse
        along = (speed * offset).sum(axis=0) * clock
        energy = clock * (np.linalg.norm(light, axis=0) - (speed * light).sum(axis=0))
        ahead = (offset * light).sum(axis=0) / energy - along
        distance_2 = np.maximum((offset**2).sum(axis=0) + along**2 - ahead**2, 0)
        sigma = 1 / ray.u**2 + (spin * ray.vector[:, 2]) ** 2
        return ClosestApproach(ahead, distance_2, energy, energy * sigma)

    def _nearby_pairs(self, middle: RayPart, reach: Array) -> tuple[Int[Array, " pairs"], Int[Array, " pairs"]]:
        """Rays and spots that may come close in a step; reach (n,), from the middle of a ray's step."""
        place = middle.vector / middle.u[:, None]
        window = np.floor(middle.delay / _BETWEEN).astype(int) if self.delay else np.zeros(len(reach), int)
        rays, spots = [np.zeros(0, int)], [np.zeros(0, int)]
        for number in np.unique(window):
            in_window = np.flatnonzero(window == number)
            near = self._tree(int(number)).query_ball_point(place[in_window], reach[in_window], return_sorted=False)
            rays.append(np.repeat(in_window, [len(some) for some in near]))
            spots += [np.asarray(some, int) for some in near if some]
        return np.concatenate(rays), np.concatenate(spots)

    def _tree(self, number: int) -> "KDTree":
        """The search tree of the spots in the middle of a window of time."""
        if number not in self._trees:
            from scipy.spatial import KDTree

            delay = (number + 0.5) * _BETWEEN if self.delay else 0.0
            self._trees[number] = KDTree(self.orbits.places(self.moment + delay).vector * self.orbits.radius[:, None])
        return self._trees[number]


class _FidoFrames(NamedTuple):
    """Orthonormal frames of FIDOs at n places.

    south, east: (n, 3) unit vectors along theta and phi.
    scales: (3, n) lengths of a unit of the radius, and of the unit vector along theta and along phi.
    sine: (n,) sin theta.
    sigma: (n,) Sigma of the metric.
    lapse: (n,) lapse.
    shift: (n,) angular velocity of the FIDO.
    """

    south: Array
    east: Array
    scales: Array
    sine: Array
    sigma: Array
    lapse: Array
    shift: Array

    @classmethod
    def at_places(cls, spin: float, r: Array, vector: Float[Array, "n 3"]) -> "_FidoFrames":
        """Frames of FIDOs at radii and unit vectors."""
        x, y, z = vector.T
        sine = np.maximum(np.hypot(x, y), 1e-300)
        east = np.stack([-y / sine, x / sine, np.zeros_like(z)], axis=-1)
        south = np.stack([z * x / sine, z * y / sine, -sine], axis=-1)
        sigma, delta = r * r + (spin * z) ** 2, kerr.horizon_product(spin, r)
        big = (r * r + spin**2) ** 2 - spin**2 * delta * sine**2
        scales = np.sqrt(np.stack([sigma / delta, sigma, big / sigma]))
        return cls(south, east, scales, sine, sigma, np.sqrt(sigma * delta / big), 2 * spin * r / big)

    def lengths(self, offset: Float[Array, "n 3"], outward: Float[Array, " n"]) -> Float[Array, "3 n"]:
        """The displacement (3, n), M, for changes of the unit vector and of the radius."""
        return self.scales * np.stack([outward, (offset * self.south).sum(axis=1), (offset * self.east).sum(axis=1)])

    def velocity(self, rate: Float[Array, "n 3"]) -> Float[Array, "3 n"]:
        """The velocity of a body at constant radius; rate: derivative of its unit vector by coordinate time."""
        return self.lengths(rate - (self.shift * self.sine)[:, None] * self.east, np.zeros_like(self.sine)) / self.lapse

    def momentum(self, ray: RayPart) -> Float[Array, "3 n"]:
        """The momentum of light of unit energy at infinity that arrives along a ray."""
        south, east = -(ray.rate * self.south).sum(axis=1), -(ray.rate * self.east).sum(axis=1)
        outward = ray.u_rate / ray.u**2 * self.scales[0] ** 2 / self.sigma
        return np.stack([outward, south, east]) / self.scales
