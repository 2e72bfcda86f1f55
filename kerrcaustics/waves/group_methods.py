"""The methods for a group of images beside a critical curve: the field and its error by each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kerrcaustics.curves.critical_points import Points
from kerrcaustics.shapes import Complex, Float
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.waves.continuation import ContinuedRing, meeting_images, meeting_parameters
from kerrcaustics.waves.dark_sides import error_beyond_caustic, error_beyond_gap, nearest_is_hidden
from kerrcaustics.waves.ring_integral import NearestCurve, next_order
from kerrcaustics.waves.summed_images import (
    field_in_pairs,
    image_sum_error,
    ring_sum_error,
    separate_error,
    unresolved_part,
)
from kerrcaustics.waves.uniform import cusp_field, ring_pair
from kerrcaustics.waves.wave_images import WaveImages

Array = np.ndarray
Field = tuple[Array, Array]
"""A field, complex, and its error, at all frequencies."""

# Measured ratio of the error of the amplitudes of two images to that of the size of the caustic to its distance.
_NOT_ROUND = 0.16
# Largest ratio of the caustic's size to the star's distance from its middle in the error of two images.
_MOST_BENT = 0.7
# The most by which a sum of images is wrong, in parts of their amplitudes.
_MOST_OFF = 2.0
# Error of a primary ring with its next phase, times the frequency, in parts of the field.
_OF_PRIMARY = 0.042
# Error of other rings and of folds, times the frequency, in parts of the field.
_OF_RING = 0.06
# Frequency added in these ratios, as errors of asymptotics grow more slowly than 1 / omega at long waves.
_LONG_WAVES = 0.1
# The growth of the error of a ring by the square of its distance from the axis, radians, and by the inverse radius of
# the viewer, as partial waves show it.
_OFF_AXIS = 3.0
# The frequency at which the error of a ring is twice that, as partial waves show it.
_LONGEST_WAVES = 0.05


@dataclass(frozen=True, eq=False)
class GroupField:
    """The waves of a group of images, by frequency: value, error and method."""

    value: Complex[Array, " frequencies"]
    error: Float[Array, " frequencies"]
    method: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ImageGroup:
    """The images beside a critical curve.

    ring: in the order of their position angles.
    others: of the same indices, but beside the next critical curve.
    calm: the ring of a star beside this one, if it lies next to a caustic.
    curve: the nearest curve of the ring, if it is smooth.
    order: of the critical curve.
    caustic: its points, None if they are not known.
    star: direction.
    nearness: of viewer and source to the hole.
    near: True if the star lies next to the caustic.
    continued: the ring continued to the star then, if it can be.
    """

    ring: WaveImages
    others: WaveImages
    calm: WaveImages
    curve: NearestCurve | None
    order: int
    caustic: Points | None
    star: Float[Array, " 3"]
    nearness: float
    near: bool
    continued: ContinuedRing | None

    def best(self, omega: Float[Array, " frequencies"], method: str) -> GroupField:
        """The method with the smallest error at each frequency, or the requested one."""
        fields = self._fields(omega)
        if method != "auto":
            fields = {name: fields[name] for name in ((method,) if method in fields else ("images",)) if name in fields}
        if not fields:
            nothing = np.zeros(len(omega))
            return GroupField(nothing + 0j, np.full(len(omega), math.inf), ("images",) * len(omega))
        names = list(fields)
        values, errors = (np.array([fields[name][i] for name in names]) for i in (0, 1))
        best, columns = errors.argmin(axis=0), np.arange(len(omega))
        return GroupField(values[best, columns], errors[best, columns], tuple(names[i] for i in best.tolist()))

    def error_if_split(self, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
        """The error where the images belong to two other groups, which sum them."""
        if self.near:
            return np.full(len(omega), float(self.ring.amplitude.sum()))
        return self._sum_error(self.calm, omega) + ring_sum_error(self.others, omega) + self._beyond_caustic(omega)

    def _fields(self, omega: Float[Array, " frequencies"]) -> dict[str, Field]:
        """The waves and their errors, by each applicable method."""
        fields: dict[str, Field] = {}
        share, count = _share(self.order, omega), len(self.ring)
        hidden = self.curve is not None and self.curve.gap is not None
        if self.curve is not None and not (self.near and self._caustic_is_hidden):
            fields["line"] = self._by_integral(self.curve, omega, share)
        if not self.near and count > 2:
            fields |= {"fold": self._as_folds(omega, share), "cusp": self._as_cusp(omega, share)}
        elif not self.near and count == 2 and (self.curve is None or hidden or self.curve.is_slow(omega).any()):
            fields["ring"] = self._as_ring(omega, share)
        if self.continued is not None:
            value, error = self.continued.field(omega, share)
            error = error + self._beyond_caustic(omega, reach=self.continued.reach)
            fields[self.continued.method] = _better(fields.get(self.continued.method), (value, error))
        if count:
            fields["images"] = self._as_images(omega, fields)
        more, unsure = self.others.field(omega), image_sum_error(self.others, omega)
        return {
            name: (np.nan_to_num(value) + more, np.nan_to_num(error, nan=math.inf, posinf=math.inf) + unsure)
            for name, (value, error) in fields.items()
        }

    def _by_integral(
        self, curve: NearestCurve, omega: Float[Array, " frequencies"], share: Float[Array, " frequencies"]
    ) -> Field:
        """The field by an integral along the nearest curve; images in its gap in pairs."""
        (value, lost), most = curve.field_and_loss(omega), np.sqrt(omega) * curve.brightest
        # The amplitude of the images without their phases; on a caustic limited to that of the field there.
        size = np.maximum(np.abs(value), np.minimum(most, self._summed_amplitude))
        error = share * curve.off_axis_factor * size + curve.error_of_phase(omega)
        slow = curve.is_slow(omega)
        value, error = np.where(slow, 0.0, value), np.where(slow, most, error)
        if curve.gap is None:
            return value, error
        hidden = self.ring[~curve.holds(self.ring.time)]
        more, unsure = field_in_pairs(hidden, np.zeros(len(hidden), bool), omega, share)
        error = error + unsure + lost
        return value + more, error + error_beyond_gap(self.calm, curve, self.caustic, self.star, omega)

    def _as_ring(self, omega: Float[Array, " frequencies"], share: Float[Array, " frequencies"]) -> Field:
        """Two images across an axis, by Bessel functions."""
        pair = self.ring[np.argsort(self.ring.time)]
        value = ring_pair(omega, int(pair.index.min()), pair.time, pair.amplitude)
        size = np.sqrt(math.pi * omega * np.ptp(pair.time) / 4) * pair.amplitude.sum()
        error = (share * self._off_axis + self._astroid_error(omega)) * np.maximum(
            np.abs(value), np.minimum(size, self._summed_amplitude)
        )
        if self.curve is not None and self.curve.gap is None:
            error = np.where(self.curve.is_slow(omega), error, math.inf)
        return value * next_order(self.order, omega), error + pair.error(omega) + self._beyond_caustic(omega)

    def _as_folds(self, omega: Float[Array, " frequencies"], share: Float[Array, " frequencies"]) -> Field:
        """Neighbours in pairs beside folds, by Airy functions."""
        value, error = field_in_pairs(self.ring, np.zeros(len(self.ring), bool), omega, share)
        closest = meeting_images(self.ring, "fold")[:2]
        return value, error + self._beyond_caustic(omega, closest.around)

    def _as_cusp(self, omega: Float[Array, " frequencies"], share: Float[Array, " frequencies"]) -> Field:
        """The three neighbours closest in time within a cusp, by Pearcey's integral, and all others in pairs."""
        ring = meeting_images(self.ring, "cusp")
        index, parameters = meeting_parameters(ring, "cusp")
        value, size = cusp_field(omega, (index[0], index[1]), parameters)
        more, unsure = field_in_pairs(ring, np.arange(len(ring)) < 3, omega, share)
        in_doubt = share + unresolved_part(ring, 3, omega)
        error = in_doubt * np.maximum(size, np.abs(value)) + ring[:3].error(omega) + unsure
        return value + more, error + self._beyond_caustic(omega, ring.around[:3])

    def _as_images(self, omega: Float[Array, " frequencies"], fields: dict[str, Field]) -> Field:
        """The sum of images; next to a caustic its difference from a finite field is part of the error."""
        value = self.ring.field(omega)
        if not self.near:
            error = self._sum_error(self.ring, omega) + separate_error(self.ring, omega)
            return value, error + self._beyond_caustic(omega)
        error = np.full(len(omega), 2 * float(self.ring.amplitude.sum())) + self.ring.error(omega)
        for finite, off in fields.values():
            error = np.fmin(error, np.abs(value - finite) + off)
        return value, error

    def _sum_error(self, ring: WaveImages, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
        """The error of the images of the ring as a sum."""
        most = _MOST_OFF * float(ring.amplitude.sum())
        return np.minimum(ring_sum_error(ring, omega) * self._astroid_factor, most)

    @property
    def _summed_amplitude(self) -> float:
        """The amplitude of the images without their phases; infinite if there are none."""
        return float(np.linalg.norm(self.calm.amplitude)) if len(self.calm) else math.inf

    @property
    def _caustic_is_hidden(self) -> bool:
        """True if the gap of the nearest curve hides the caustic next to the star."""
        if self.curve is None or self.caustic is None:
            return False
        return nearest_is_hidden(self.curve, self.caustic, self.star)

    def _beyond_caustic(
        self,
        omega: Float[Array, " frequencies"],
        around: Float[Array, " images"] | None = None,
        reach: float | None = None,
    ) -> Float[Array, " frequencies"]:
        """The error by a caustic beside the star, less the part in the field: see `error_beyond_caustic`."""
        if self.caustic is None or not len(self.ring):
            return np.zeros(len(omega))
        return error_beyond_caustic(self.caustic, self.star, self.calm, omega, around, reach)

    def _size_and_away(self, caustic: Points) -> tuple[float, float]:
        """The distance of the farthest point of a caustic from its middle, and that of the star."""
        middle = caustic.direction.mean(axis=0)
        return float(lengths(caustic.direction - middle).max()), float(np.linalg.norm(self.star - middle))

    @property
    def _astroid_factor(self) -> float:
        """The factor by which the error of two images as a sum is larger than on a ring about an axis.

        With the phase d cos(psi) + c cos(2 psi) / 4 round the ring, c the size of the astroid and d the distance of the
        star, the next term of stationary phase is at most so much larger.
        """
        if self.caustic is None or len(self.ring) != 2:
            return 1.0
        size, away = self._size_and_away(self.caustic)
        part = min(size / max(away, size), _MOST_BENT)
        return (1 + 4 * part) / (1 - part) ** 2

    @property
    def _off_axis(self) -> float:
        """The factor by which the error of a ring is larger than on the axis."""
        if self.caustic is None:
            return 1.0
        away = float(lengths(self.caustic.direction - self.star).max())
        return 1 + _OFF_AXIS * self.nearness * away**2

    def _astroid_error(self, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
        """The error of a ring by its field, as its caustic is no point.

        An astroid with cusps at c from its middle belongs to a phase omega B c cos(2 psi) / 4 round the ring, B the
        impact parameter. The times of two images contain its values there: the remaining error falls as 1 / x beside
        the axis, x the argument of the Bessel function, and is of second order on it. Their amplitudes differ from
        those of a ring.
        """
        if self.caustic is None:
            return np.zeros(len(omega))
        size, away = self._size_and_away(self.caustic)
        x = omega * float(np.ptp(self.ring.time)) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            cusps = np.divide(size, away)
            phase = x * cusps / 4
            off = _NOT_ROUND * cusps + phase**2 / 4 + phase * x / (1 + x**2)
            return np.nan_to_num(np.minimum(off, 1.0), nan=1.0)


def _better(one: Field | None, other: Field) -> Field:
    """At each frequency the field with the smaller error."""
    if one is None:
        return other
    best = np.nan_to_num(one[1], nan=math.inf) < np.nan_to_num(other[1], nan=math.inf)
    return np.where(best, one[0], other[0]), np.where(best, one[1], other[1])


def ring_error(
    curves: Sequence[NearestCurve], omega: float, size: Float[Array, "rows columns"], ring: WaveImages
) -> Float[Array, "rows columns"]:
    """The error of integrals of a ring whose fields have the given moduli, beside images of one star."""
    return (
        _share(curves[0].order, omega)
        * max(curve.off_axis_factor for curve in curves)
        * np.maximum(size, float(np.linalg.norm(np.minimum(ring.amplitude, size.max()))))
    ) + max(float(curve.error_of_phase(np.array([omega]))[0]) for curve in curves)


def _share(order: int, omega: Any) -> Any:
    """The error of a ring or a fold by its field."""
    share = (_OF_PRIMARY if order == 1 else _OF_RING) / (omega + _LONG_WAVES)
    return share * (1 + (_LONGEST_WAVES / omega) ** 4)
