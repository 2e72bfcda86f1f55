"""Images next to the shadow edge, where a unit vector of doubles is too coarse for their place.

The path of a ray that winds about the hole depends on its distance from the shadow edge through d alone, the square of
half the distance of the outer roots of R. As a function of N, d is accurate to about 1e-16, and e^(pi k) magnifies this
error for an image of index k. So d is kept separately from N, and the variables of Newton's method are ln |d| and the
distance s along the curve of equal d, in shadow sizes. N itself, with it b and q, and the time are then accurate to
round-off.
"""

from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.calls import deep_ends, depth
from kerrcaustics.beams.ends import Spherical
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.sphere import flattened, moved, tangent_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Error of a direction, radians, above which an image is refined.
_POOR = 1e-10
# Error of the time, relative to it, above which an image is refined.
_LATE = 1e-11
# Least Morse index of images that are refined.
_WINDING = 2
# Newton steps.
_STEPS = 4
# Half-width of the differences that approximate derivatives, in s and in ln |d|.
_DIFFERENCE = 1e-6
# Rounding of n' per radian of the path.
_OF_END = 2e-15
# Rounding of the time, relative to it.
_OF_TIME = 1e-15
# Rounding of N, radians.
_OF_SKY = 4e-16
# Newton steps of N toward the given d.
_RETURNS = 3
# Largest distance from it in the end, radians.
_BESIDE = 1e-13


class RefinedImages(NamedTuple):
    """Images that were refined.

    which: Numbers of the images.
    sky: Directions N.
    error: Errors of the directions, radians.
    time: Times from the star, GM/c^3.
    time_error: Errors of the times.
    """

    which: Array
    sky: Array
    error: Array
    time: Array
    time_error: Array


class _Ends(NamedTuple):
    """Ends of rays.

    direction: n'.
    time: Travel time, GM/c^3.
    phase: Length of the path in radians.
    noise: Round-off of n' by the formulas, radians.
    turn_noise: Round-off of the azimuth, radians.
    time_noise: Round-off of the time.
    """

    direction: Array
    time: Array
    phase: Array
    noise: Array
    turn_noise: Array
    time_noise: Array

    def rounding(self) -> Array:
        """Rounding of n' (n, 2), along e_theta and e_phi: next to the axis a turn about it moves n' little."""
        both = np.maximum(_OF_END * (1 + self.phase), self.noise)
        turned = self.turn_noise * np.hypot(self.direction[:, 0], self.direction[:, 1])
        return np.stack([both, both + turned], axis=-1)


def needs_refinement(
    index: Int[Array, " images"],
    error: Float[Array, " images"],
    time: Float[Array, " images"] | None,
    time_error: Float[Array, " images"] | None,
) -> Bool[Array, " images"]:
    """True for images that gain from being refined.

    Parameters: index, Morse index; error, radians; time and its error, None if there is none.
    """
    poor = error > _POOR
    if time is not None and time_error is not None:
        poor |= time_error > _LATE * np.abs(time)
    return poor & (index >= _WINDING)


def refined_at_shadow_edge(
    camera: Viewer,
    sky: Float[Array, "images 3"],
    error: Float[Array, " images"],
    star: Float[Array, "images 3"],
    end: Spherical,
    second_arrival: Bool[Array, " images"],
) -> RefinedImages:
    """Images close to the shadow edge, to round-off.

    Parameters: sky, directions N as the camera sees them, which is at rest; error, of them, radians; star, unit
    vectors; end, the sphere of the stars; second_arrival, True for its second arrivals.

    Errors: images whose error does not shrink are left out.
    """
    refined, size, time, time_error, good = _DeepSearch(camera, end, sky, star, second_arrival).run()
    good &= size < error
    return RefinedImages(np.flatnonzero(good), refined[good], size[good], time[good], time_error[good])


class _DeepSearch:
    """Newton's method in (s, ln |d|), for some images at once."""

    def __init__(self, camera: Viewer, end: Spherical, sky: Array, star: Array, second_arrival: Array) -> None:
        self._camera, self._end, self._star, self._second_arrival = camera, end, star, second_arrival
        self._start = sky
        # Of the shadow on the sky, about, from close by and from far away.
        frame = camera.frame()
        self._size = min(1.0, 5 / (frame.zoom * frame.radius))
        self._depth, slope = self._d(sky), self._slope(sky)
        self._steep = np.linalg.norm(slope, axis=1)
        self._across = slope / self._steep[:, None]
        self._along = self._size * np.cross(sky, self._across)

    def run(self) -> tuple[Array, ...]:
        """Directions, their errors, times, and theirs; True where they are good to round-off."""
        place = np.zeros((len(self._start), 2))
        with np.errstate(invalid="ignore", divide="ignore"):
            for _ in range(_STEPS):
                inverse, _, residual, _ = self._linear(place)
                place = place + np.einsum("nij,nj->ni", inverse, residual)
            inverse, rate, residual, ends = self._linear(place)
        rounding = ends.rounding()
        wrong = np.abs(residual) + rounding
        moved_by = np.einsum("nij,nj->ni", np.abs(inverse), wrong)
        sky, missed = self._sky(place)
        # N is rounded along the curve of equal d, too, and b and q with it.
        moved_by[:, 0] += (missed + _OF_SKY) / self._size
        time_error = np.abs(rate * moved_by).sum(axis=1) + _OF_TIME * np.abs(ends.time) + ends.time_noise
        good = (wrong < 10 * rounding).all(axis=1) & (missed < _BESIDE) & np.isfinite(time_error)
        return sky, self._size * moved_by[:, 0], ends.time, time_error, good

    def _linear(self, place: Array) -> tuple[Array, Array, Array, _Ends]:
        """The inverse of the derivative of n' by the place, the derivative of the time, the residual, and the ends."""
        steps = _DIFFERENCE * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        ends = self._ends((place + steps[:, None]).reshape(-1, 2))
        here, *beside = ends.direction.reshape(5, -1, 3)
        times = ends.time.reshape(5, -1)
        columns = [flattened(here, beside[i] - beside[i + 1]) / (2 * _DIFFERENCE) for i in (0, 2)]
        rate = np.stack([times[1] - times[2], times[3] - times[4]], axis=1) / (2 * _DIFFERENCE)
        (a, c), (b, d) = (column.T for column in columns)
        inverse = np.moveaxis(np.array([[d, -b], [-c, a]]) / (a * d - b * c), 2, 0)
        residual = flattened(here, self._star - here)
        count = len(self._start)
        return inverse, rate, residual, _Ends(here, times[0], *(part[:count] for part in ends[2:]))

    def _sky(self, place: Array) -> tuple[Array, Array]:
        """Directions N of given d, and how far (radians) they miss it."""
        copies = len(place) // len(self._start)
        start, along, across = (np.tile(x, (copies, 1)) for x in (self._start, self._along, self._across))
        steep, depth = (np.tile(x, copies) for x in (self._steep, self._depth))
        target_depth, away = depth * np.exp(place[:, 1]), np.zeros(len(place))

        def direction_and_miss() -> tuple[Array, Array]:
            sky = moved(start, along * place[:, :1] + across * away[:, None])
            return sky, (target_depth - self._d(sky)) / steep

        for _ in range(_RETURNS):
            away = away + direction_and_miss()[1]
        sky, miss = direction_and_miss()
        return sky, np.abs(miss)

    def _ends(self, place: Array) -> _Ends:
        """Ends of rays with the d of the place, which replaces the less accurate one of N."""
        copies = len(place) // len(self._start)
        d = np.tile(self._depth, copies) * np.exp(place[:, 1])
        leaves = np.tile(self._second_arrival, copies)
        return _Ends(*deep_ends(self._camera, self._sky(place)[0], d, self._end, leaves))

    def _d(self, sky: Array) -> Array:
        return depth(self._camera, sky)

    def _slope(self, sky: Array) -> Array:
        """The derivative (n, 3) of d on the sky."""
        step = _DIFFERENCE * self._size
        basis = np.stack(tangent_basis(sky))
        rates = [self._d(moved(sky, step * e)) - self._d(moved(sky, -step * e)) for e in basis]
        return np.einsum("ij,ijk->jk", rates, basis) / (2 * step)
