"""Rays to a source that moves: where each meets the sphere of the source's moment, and how it misses the source.

A direction N and an emission time t are an image where the ray ends at the source, two equations for three numbers:
so images are curves in (N, t). The equations are written in the plane across the ray at the source. There they stay
regular where the ray only grazes the sphere, which is a matter of the coordinates alone.

With E = 1 and p the photon's momentum toward the camera, a source that moves by dx changes the time of its light by
-p.dx: so light sent dt later arrives (1 - p.v) dt later.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.beam import Beams, Status
from kerrcaustics.beams.emitters import radial_momentum
from kerrcaustics.beams.spheres import Spheres
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.lens_map.search_sky import TOLERANCE, SearchSky
from kerrcaustics.lens_map.sky_chart import Chart, chart_of
from kerrcaustics.light_curves.bent_steps import bent_step
from kerrcaustics.orbits.motions import BodyMotion, BodyPlaces
from kerrcaustics.orbits.orbit import clock_rates
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.kerr import horizon_product
from kerrcaustics.spacetime.sphere import flattened, lengths, tangent_basis, unit

Array = np.ndarray

# Relative step outward over which the change of theta along a ray is taken.
_FURTHER = 1e-6
# A ray that misses the source's sphere is evaluated outside its turning point, by this part of the relative miss.
# The error made so vanishes as the ray approaches the sphere.
_BESIDE = 0.1
# The least and the largest distance from the turning point, over the radius.
_LEAST_BESIDE = 1e-9
_MOST_BESIDE = 1e-4


@dataclass(frozen=True)
class Source:
    """A source as a viewer searches for it: its motion, the hole, and the sky on which the search is made."""

    searched: SearchSky
    motion: BodyMotion

    @property
    def spin(self) -> float:
        """The spin of the hole."""
        return self.searched.search_camera.spin

    @property
    def chart(self) -> Chart:
        """Coordinates about the shadow edge."""
        return chart_of(self.searched.search_camera)

    def arrivals(
        self,
        sky: Float[Array, "n 3"],
        time: Float[Array, " n"],
        second: Bool[Array, " n"],
        radius: Float[Array, " n"] | None = None,
    ) -> "Arrivals":
        """The rays of directions on the search sky, to the spheres of the source at emission times, or to others."""
        places = self.motion.places(time)
        radius = places.radius if radius is None else radius
        beams, cosine_change = self._trace(sky, radius, second)
        # Rays that turn outside the sphere are evaluated next to their turning point.
        passed = np.flatnonzero(beams.status == Status.MISSED)
        if len(passed):
            nearest = _turning_points(self.spin, np.asarray(beams.impact)[passed], np.asarray(beams.carter)[passed])
            part = np.clip(_BESIDE * (nearest / radius[passed] - 1), _LEAST_BESIDE, _MOST_BESIDE)
            beside_turning_point, slope = self._trace(sky[passed], nearest * (1 + part), second[passed])
            for name, values in vars(beams).items():
                if isinstance(values, np.ndarray):
                    values[passed] = getattr(beside_turning_point, name)
            cosine_change[passed] = slope
        return Arrivals(self, sky, time, second, places, beams, cosine_change)

    def _trace(
        self, sky: Float[Array, "n 3"], radius: Float[Array, " n"], second: Bool[Array, " n"]
    ) -> tuple[Beams, Float[Array, " n"]]:
        """Beams to spheres, and the change of cos theta a little further out."""
        n = len(sky)
        spheres = Spheres(np.concatenate([radius, radius * (1 + _FURTHER)]), np.concatenate([second, second]))
        beams = beams_of_directions(
            self.searched.search_camera,
            np.concatenate([sky, sky]),
            "auto",
            TOLERANCE,
            end=spheres,
            time=True,
            crossings=False,
            redshift=False,
            constants=True,
        )
        arrays = {name: values[:n] for name, values in vars(beams).items() if isinstance(values, np.ndarray)}
        return replace(beams, **arrays), beams.direction[n:, 2] - beams.direction[:n, 2]


def along_sky(sky: Float[Array, "n 3"], step: Float[Array, "n 2"]) -> Float[Array, "n 3"]:
    """Directions after steps along `tangent_basis(N)`."""
    first, second = tangent_basis(sky)
    ahead = sky + step[:, :1] * first + step[:, 1:] * second
    return unit(ahead)


def solutions(matrix: Float[Array, "n k k"], target: Float[Array, "n k"]) -> Float[Array, "n k"]:
    """Solutions of systems of equations, NaN where there is none."""
    broken = np.asarray(~np.isfinite(matrix).all(axis=(1, 2)) | ~np.isfinite(target).all(axis=1))
    matrix = np.where(broken[:, None, None], np.eye(target.shape[1]), matrix)
    singular = np.asarray(np.linalg.det(matrix) == 0)
    matrix[singular] = np.eye(target.shape[1])
    step = np.linalg.solve(matrix, target[:, :, None])[:, :, 0]
    step[broken | singular] = np.nan
    return step


def _turning_points(spin: float, b: Float[Array, " n"], q: Float[Array, " n"]) -> Float[Array, " n"]:
    """The largest roots of the radial potential."""
    coefficients = np.stack([1 + 0 * b, 0 * b, spin**2 - b**2 - q, 2 * (q + (b - spin) ** 2), -(spin**2) * q], axis=-1)
    roots = [np.roots(row) for row in coefficients]
    return np.array([np.max(root.real[np.abs(root.imag) < 1e-6 * np.abs(root)], initial=0.0) for root in roots])


class OrbitErrors(NamedTuple):
    """Errors (n,) that follow from those of the orbit.

    place: of the place, over the radius.
    delay: of the arrival time, GM/c^3.
    ratio: of the frequency ratio, relative.
    """

    place: Array
    delay: Array
    ratio: Array


@dataclass(frozen=True)
class Arrivals:
    """Rays at the spheres of a source.

    source: the source that moves.
    sky: directions on the search sky.
    time: emission times, GM/c^3.
    second: True for rays that arrive at the sphere for the second time.
    places: places of the source.
    beams: beams from its spheres.
    cosine_change: change of cos theta a little further out along the ray.
    """

    source: Source
    sky: Float[Array, "n 3"]
    time: Float[Array, " n"]
    second: Bool[Array, " n"]
    places: BodyPlaces
    beams: Beams
    cosine_change: Float[Array, " n"]

    @property
    def reach(self) -> Bool[Array, " n"]:
        """True where the ray reaches the radius of the source."""
        return np.asarray(self.beams.radius == self.places.radius)

    @cached_property
    def momentum(self) -> tuple[Array, Array, Array]:
        """p_r, p_theta and b / sin theta (n,) of the light, of unit energy, toward the camera."""
        a, z = self.source.spin, self.beams.direction[:, 2]
        with np.errstate(invalid="ignore", divide="ignore"):
            around = np.where(self._sine > 0, self._constants[0] / self._sine, 0.0)
            radial = radial_momentum(a, self._constants, self.beams.radius)
            polar = np.sqrt(np.maximum(self._constants[1] + z * z * (a * a - around**2), 0))
        # Followed backward the ray moves outward: so the light moves inward.
        inward = np.where(self.beams.outward, -1.0, 1.0)
        return inward * radial, -np.sign(self.cosine_change) * inward * polar, around

    @property
    def _constants(self) -> tuple[Array, Array]:
        """b and q of the light."""
        return np.asarray(self.beams.impact), np.asarray(self.beams.carter)

    @property
    def _sine(self) -> Array:
        """sin theta where rays end."""
        return np.hypot(self.beams.direction[:, 0], self.beams.direction[:, 1])

    @property
    def _delta(self) -> Array:
        r = self.beams.radius
        return horizon_product(self.source.spin, r)

    @cached_property
    def radial_root(self) -> tuple[Array, Array]:
        """sqrt(R), of the radial potential of the light at the source (n,), and its relative error."""
        a, r, (b, _) = self.source.spin, self.beams.radius, self._constants
        by_b = 2 * a * (r * r + a * a - a * b) + 2 * self._delta * np.abs(b - a)
        off = by_b * np.asarray(self.beams.impact_error) + self._delta * np.asarray(self.beams.carter_error)
        size = np.maximum((self._delta * self.momentum[0]) ** 2, off)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.sqrt(size), off / (2 * size) + 1e-15 * r**4 / size

    @cached_property
    def _scales(self) -> tuple[Array, Array, Array]:
        """Lengths of steps dr, dtheta and sin theta dphi at the source, over its radius."""
        a, r, z = self.source.spin, self.places.radius, self.places.vector[:, 2]
        sigma, delta = r * r + (a * z) ** 2, self._delta
        big = (r * r + a * a) ** 2 - a * a * delta * (1 - z * z)
        return np.sqrt(sigma / delta) / r, np.sqrt(sigma) / r, np.sqrt(big / sigma) / r

    @cached_property
    def ray_tangent(self) -> Float[Array, "n 3"]:
        """Unit vectors along the ray, in lengths along r, theta, phi."""
        a, r, (p_r, p_theta, around) = self.source.spin, self.beams.radius, self.momentum
        drag = a * (r * r + a * a - a * self._constants[0]) / self._delta - a
        # dr, dtheta, sin theta dphi by Mino time.
        motion = np.stack([self._delta * p_r, p_theta, around + drag * self._sine], axis=-1)
        ahead = motion * np.stack(self._scales, axis=-1)
        return unit(ahead)

    @cached_property
    def transverse_steps(self) -> Float[Array, "2 n 3"]:
        """Two steps dr, dtheta, sin theta dphi across the ray, of the length 1 over the radius."""
        return np.stack(tangent_basis(self.ray_tangent)) / np.stack(self._scales, axis=-1)

    def _transverse(self, step: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
        """Steps dr, dtheta, sin theta dphi, seen along the ray: lengths over the radius."""
        long = step * np.stack(self._scales, axis=-1) ** 2
        return np.stack([(long * across).sum(axis=1) for across in self.transverse_steps], axis=-1)

    def _step(self, vector: Float[Array, "n 3"], radius: Array | float = 0.0) -> Float[Array, "n 3"]:
        """Steps of unit vectors and of radii as dr, dtheta, sin theta dphi."""
        flat = flattened(self.beams.direction, vector)
        return np.concatenate([np.broadcast_to(radius, len(flat))[:, None], flat], axis=1)

    @cached_property
    def offset(self) -> Float[Array, "n 3"]:
        """dr, dtheta, sin theta dphi from the source to the ray."""
        return self._step(self.beams.direction - self.places.vector, self.beams.radius - self.places.radius)

    @cached_property
    def _along_ray(self) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """The offset in lengths over the radius, and its part along the ray."""
        long = self.offset * np.stack(self._scales, axis=-1)
        return long, (long * self.ray_tangent).sum(axis=1)

    @property
    def offset_along_ray(self) -> Float[Array, " n"]:
        """Distance along the ray from its end to the point closest to the source, over the source's radius."""
        return np.abs(self._along_ray[1])

    @property
    def closest_radius(self) -> Float[Array, " n"]:
        """Radius at which the ray is closest to the source, over the source's radius."""
        long, along = self._along_ray
        step = long - along[:, None] * self.ray_tangent
        return 1 + step[:, 0] / self._scales[0] / self.places.radius

    @property
    def columns(self) -> Float[Array, "n 3 2"]:
        """The change of the offset with N along `tangent_basis(N)`."""
        return np.pad(self.beams.jacobian, ((0, 0), (1, 0), (0, 0)))

    @cached_property
    def velocity(self) -> Float[Array, "n 3"]:
        """dr, dtheta, sin theta dphi of the source per unit of its time."""
        return self._step(self.places.rate, self.places.radius_rate)

    @cached_property
    def miss(self) -> Float[Array, "n 2"]:
        """The displacement by which the ray misses the source, across the ray and over the radius."""
        return self._transverse(self.offset)

    @cached_property
    def by_sky(self) -> Float[Array, "n 2 2"]:
        """The change of the miss with N along `tangent_basis(N)`."""
        return np.stack([self._transverse(self.columns[:, :, i]) for i in (0, 1)], axis=-1)

    @cached_property
    def by_time(self) -> Float[Array, "n 2"]:
        """The change of the miss with the emission time."""
        return -self._transverse(self.velocity)

    @cached_property
    def rate(self) -> Float[Array, " n"]:
        """The ratio of dt of arrival to dt of emission, 1 - p.v."""
        return 1 - (np.stack(self.momentum, axis=-1) * self.velocity).sum(axis=1)

    @cached_property
    def arrival(self) -> Float[Array, " n"]:
        """The time of the viewer at which the source's own light arrives, from the ray close to it."""
        travel_time, _ = self.source.searched.viewer_time(
            np.asarray(self.beams.time), np.asarray(self.beams.time_error)
        )
        return self.time + travel_time + (np.stack(self.momentum, axis=-1) * self.offset).sum(axis=1)

    @cached_property
    def orbit_errors(self) -> "OrbitErrors":
        """Errors of the arrival time, the place and the light that follow from those of the orbit."""
        errors, radius = self.source.motion.errors(self.time), self.places.radius
        scales = np.stack(self._scales, axis=-1) * radius[:, None]
        longest = np.maximum(scales[:, 0], scales[:, 1:].max(axis=1) / radius)
        place, velocity = errors.place * longest, errors.velocity * longest
        push = lengths(np.stack(self.momentum, axis=-1) / scales)
        with np.errstate(invalid="ignore", divide="ignore"):
            # Bounds of the changes of (dtau / dt)^2 and of 1 - p.v, the factors of the ratio.
            ratio = (place + velocity) * (2 / clock_rates(self.source.spin, self.places) + push / np.abs(self.rate))
        return OrbitErrors(place, push * place * radius, ratio)

    def stepped(self, step: Float[Array, "n 2"]) -> Float[Array, "n 3"]:
        """The directions after steps along `tangent_basis(N)`."""
        first, second = tangent_basis(self.sky)
        return bent_step(self.source.chart, self.sky, step[:, :1] * first + step[:, 1:] * second)
