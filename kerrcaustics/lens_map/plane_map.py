"""The map from lines on the search sky to one crossing of the equatorial plane, and its inverse along a line."""

from dataclasses import dataclass

import numpy as np

from kerrcaustics.beams.beam import Beams, Rays, Status
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.beams.trace import beams_of_directions, rays_of_directions
from kerrcaustics.lens_map.sky_lines import Lines
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import tangent_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Steps to a circle along a line; every so many halve the bracket, as Newton's steps may creep.
_MOST_STEPS, _HALVED = 90, 5
# Largest Newton step in the logarithm of the distance.
_LARGEST = 3.0
# Largest Newton step where the bracket holds 0, in parts of the distance.
_PART = 0.3
# Length added to that part, radians.
_BESIDE = 1e-3
# Errors of the beam within which a radius is that of the circle.
_ERRORS = 4.0
# Miss below which a place has no more digits if the miss does not become smaller.
_SMALL = 1e-9
# Width of a bracket that has no more digits, radians.
_FINEST = 5e-17
# Beams with a larger ratio of their diameters are never taken as flat.
_FLAT = 1e-10
# Tolerance of rays whose radius alone is needed.
_COARSE = 1e-6
# Tolerance of rays without their beams.
_FINE = 1e-9


@dataclass(frozen=True)
class Crossings(Rows):
    """Rays that cross the plane, one entry each.

    edge_phase: parameter of the line on the sky.
    distance: distance of the ray along the line, radians.
    sky: direction N.
    radius: radius of the crossing.
    azimuth: azimuth of the crossing, unwrapped along the ray, radians.
    index: Morse index.
    ratio: delta_minus / delta_plus.
    ratio_error: error of the ratio.
    minor: |delta_minus|.
    error: error of the crossing, relative to the radius, or radians.
    slope: d ln r / d distance along the line.
    gradient: the largest d ln r / d N.
    """

    edge_phase: Float[Array, " points"]
    distance: Float[Array, " points"]
    sky: Float[Array, "points 3"]
    radius: Float[Array, " points"]
    azimuth: Float[Array, " points"]
    index: Int[Array, " points"]
    ratio: Float[Array, " points"]
    ratio_error: Float[Array, " points"]
    minor: Float[Array, " points"]
    error: Float[Array, " points"]
    slope: Float[Array, " points"]
    gradient: Float[Array, " points"]

    @property
    def flatness(self) -> Float[Array, " points"]:
        """The ratio, and 0 where that is small and not larger than its error: for searches of flat beams."""
        return np.where(np.abs(self.ratio) <= np.minimum(self.ratio_error, _FLAT), 0.0, self.ratio)

    def miss(self, radius: float | Array) -> Float[Array, " points"]:
        """Distance from a circle, in ln r."""
        return np.abs(np.log(self.radius / radius))


def plane_rays(camera: Viewer, sky: Array, end: EquatorialPlane, *, redshift: bool = False) -> Rays:
    """Rays of directions (..., 3) to a crossing of the plane: their radii, without their beams."""
    return rays_of_directions(camera, sky, "auto", _FINE, end=end, redshift=redshift)


@dataclass(eq=False)
class PlaneMap:
    """The sky of a camera at rest, or of an observer, to a crossing of the plane.

    beams_traced, engines_used: what it took so far.
    """

    camera: Viewer
    end: EquatorialPlane
    engine: str
    tolerance: float

    def __post_init__(self) -> None:
        """Start to count."""
        self.beams_traced, self.engines_used = 0, set[str]()

    def level(self, lines: Lines, distance: Float[Array, "lines places"]) -> Float[Array, "lines places"]:
        """1 / r at places on each line: 0 where rays escape before; twice the horizon's where they fall in."""
        rays = rays_of_directions(self.camera, lines.sky(distance), self.engine, _COARSE, end=self.end)
        lost = np.where(rays.status == Status.CAPTURED, 2 / kerr.horizon(self.camera.spin), 0.0)
        return np.where(np.isfinite(rays.radius), 1 / rays.radius, lost)

    def beams(self, sky: Float[Array, "points 3"], least: float = 0.0) -> Beams:
        """Beams of directions N; least, the tolerance where a larger one than usual will do."""
        tolerance = max(least, self.tolerance)
        beams = beams_of_directions(
            self.camera, sky, self.engine, tolerance, end=self.end, crossings=False, redshift=False
        )
        self.beams_traced += len(sky)
        self.engines_used.update(beams.engines)
        return beams

    def points(self, lines: Lines, distance: Float[Array, " points"]) -> Crossings:
        """The rays at places on lines."""
        return self._crossings_and_log_radius(lines, distance)[0]

    def on_circles(
        self,
        lines: Lines,
        radius: Float[Array, " points"],
        distance: Float[Array, " points"],
        bracket: tuple[Array, Array] | None = None,
        sense: Array | float = 1.0,
    ) -> Crossings:
        """The points at which lines meet circles, from guesses of the distance.

        The radius is taken to grow along each line from one end of the bracket to the other one, by default those of
        the line, or to fall where `sense` is -1. Where there is no such point the last place is returned.
        """
        distance, log_radius = distance.copy(), np.log(radius)
        low, high = (part.copy() for part in bracket or (lines.first, lines.last))
        sense = np.broadcast_to(sense, distance.shape)
        left, best = np.arange(len(lines)), np.full(len(lines), np.inf)
        order, parts = [], []
        for step in range(_MOST_STEPS):
            here, log_r = self._crossings_and_log_radius(lines[left], distance[left])
            beyond = log_r - log_radius[left]
            low[left], high[left] = _narrowed(low[left], high[left], distance[left], sense[left] * beyond)
            miss = np.abs(beyond)
            done = (miss <= _ERRORS * here.error) | ((miss < _SMALL) & (miss >= best[left]))
            done |= (high[left] - low[left] <= _FINEST) | (step == _MOST_STEPS - 1)
            best[left] = np.minimum(best[left], miss)
            order.append(left[done])
            parts.append(here[done])
            halved = np.full(len(left), step % _HALVED == _HALVED - 1)
            distance[left] = _next(distance[left], beyond / here.slope, low[left], high[left], halved)
            left = left[~done]
            if not len(left):
                break
        return parts[0].joined(*parts[1:])[np.argsort(np.concatenate(order))]

    def _crossings_and_log_radius(
        self, lines: Lines, distance: Float[Array, " points"]
    ) -> tuple[Crossings, Float[Array, " points"]]:
        """The rays at places on lines, and ln r: infinite where the ray escapes, minus infinity where it falls in."""
        sky = lines.sky(distance)
        beams = self.beams(sky)
        radius, j = np.asarray(beams.radius), beams.jacobian[:, 0]
        first, second = (np.einsum("ij,ij->i", e, lines.tangent(distance)) for e in tangent_basis(sky))
        lost = np.where(beams.status == Status.CAPTURED, -np.inf, np.inf)
        return Crossings(
            edge_phase=lines.edge_phase,
            distance=distance,
            sky=sky,
            radius=radius,
            azimuth=beams.azimuth,
            index=np.asarray(beams.index),
            ratio=beams.delta_minus / beams.delta_plus,
            ratio_error=beams.diameter_error,
            minor=np.abs(beams.delta_minus),
            error=beams.error,
            slope=(j[:, 0] * first + j[:, 1] * second) / radius,
            gradient=np.linalg.norm(j, axis=-1) / radius,
        ), np.where(np.isfinite(radius), np.log(radius), lost)


def _narrowed(low: Array, high: Array, distance: Array, beyond: Array) -> tuple[Array, Array]:
    """The bracket with a place in it, at which the radius is too large, or too small."""
    return np.where(beyond < 0, distance, low), np.where(beyond < 0, high, distance)


def _next(distance: Array, step: Array, low: Array, high: Array, halved: Array) -> Float[Array, " points"]:
    """Newton's next place, or the middle of the bracket: by logarithms where that lies on one side of 0."""
    logarithmic = low * high > 0
    most = _PART * np.abs(distance) + _BESIDE
    with np.errstate(all="ignore"):
        far = distance * np.exp(np.clip(-step / distance, -_LARGEST, _LARGEST))
        newton = np.where(logarithmic, far, distance - np.clip(step, -most, most))
        middle = np.where(logarithmic, np.sign(low) * np.sqrt(low * high), (low + high) / 2)
    return np.where((newton > low) & (newton < high) & ~halved, newton, middle)
