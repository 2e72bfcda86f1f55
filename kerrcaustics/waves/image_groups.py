"""Waves of images in groups of two neighbouring indices: what each method says of a group, its error, and the best."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from kerrcaustics.curves.critical_points import Points
from kerrcaustics.curves.winding import distance_from_sides
from kerrcaustics.images.sheets import HIGHEST_INDEX
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.waves.nearest_curve import FARTHEST, nearest_curve
from kerrcaustics.waves.ring_integral import NearestCurve, next_order
from kerrcaustics.waves.uniform import cusp_triple, fold_pair, ring_pair
from kerrcaustics.waves.wave_images import WaveImages
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray

# Decay of waves beyond a fold, by frequency and the 3/2 power of the distance: of the impact parameters of photon
# orbits, about.
_DECAY = 10 / 3
# Amplitudes of two images by those of a ring, by the size of the caustic and its distance: what was measured.
_NOT_ROUND = 0.16
# What is on a fold, by the amplitude of images beside it that are seen, and the sixth root of the frequency.
_BESIDE_FOLD = 1.6
# Position angles beside images, radians, at which a caustic is that from which they come.
_BESIDE_IMAGES = 0.3
# The size of a caustic by the distance of the star from its middle, at most, with which the error of two images grows.
_MOST_BENT = 0.7
# Sizes of a caustic beyond which it is small.
_SMALL = 3.0
# Errors times the frequency, in parts of the field: of separate images, of a primary ring with its next phase, and of
# other rings and folds; a frequency that is added to it, as asymptotics of long waves fail by less than that.
_OF_IMAGES, _OF_PRIMARY, _OF_RING, _LONG_WAVES = 0.01, 0.042, 0.06, 0.1
# The growth of the error of a ring by the square of its distance from the axis, radians, and by the inverse radius of
# the viewer, as partial waves show it.
_OFF_AXIS = 3.0
# The frequency at which the error of a ring is twice that, as partial waves show it.
_LONGEST_WAVES = 0.05
# Errors of two images as a sum, by the phase between them: at a fold and on a ring, and the next order.
_AT_FOLD, _ON_RING, _NEXT_ORDER = 0.14, 0.18, 0.7
# The same of an image beside a cusp, by its phase to those that are not there.
_BESIDE_CUSP = 0.4
# The amplitude of many images of one index, by the root of the sum of squares.
_IN_PHASE = 2.0
# Amplitude of each index by that of two before, as images are on the same side then, at least and at most; and the rest
# by the highest index, where no more is known. How much more than so the rest may be, where indices have the same
# number of images, and where it grows; and the whole where stars are within caustics.
_LEAST_RATIO, _LARGEST_RATIO, _UNKNOWN_RATIO = 0.05, 0.8, 0.75
_UNSURE, _MORE = (1.25, 2.5), 1.3


@dataclass(frozen=True, eq=False)
class GroupWaves:
    """The waves of a group of images: value, error and method by frequency; last: the highest index in it."""

    value: Float[Array, " frequencies"]
    error: Float[Array, " frequencies"]
    method: tuple[str, ...]
    last: int


def best_parts(
    source: WaveSource,
    waves: WaveImages,
    highest: int,
    omega: Float[Array, " frequencies"],
    how: str,
) -> list[GroupWaves]:
    """Groups of two neighbouring indices, from 0 and 1 on or from 1 and 2 on: those with the smaller total error."""
    sheets, star = source.sheets(min(highest + 1, HIGHEST_INDEX)), source.star
    groups = []
    for order in range(1, highest + 2):
        caustic = sheets.curves.curves[order - 1].points if order <= len(sheets.curves.curves) else None
        curve = None
        near = caustic is not None and lengths(caustic.direction - star).min() < FARTHEST
        if near and how in ("auto", "line"):
            curve = nearest_curve(source, sheets.curves, order)
        if curve is not None and not curve.is_smooth:
            curve = None
        ring = waves.ring(order)
        on_curve = np.ones(len(ring), bool) if curve is None or curve.gap else curve.holds(ring.time)
        groups.append(_BesideCurve(ring[on_curve], ring[~on_curve], curve, order, caustic, star, source.nearness))
    choices = []
    for first in (1, 2):
        parts = [] if first == 1 else [_alone(waves[waves.index == 0], omega)]
        parts += [group.best(omega, how) for group in groups[first - 1 :: 2]]
        # Neighbours that belong to two groups are summed.
        torn = sum((group.torn(omega) for group in groups[2 - first :: 2]), np.zeros(len(omega)))
        parts.append(GroupWaves(np.zeros(len(omega)), torn, ("images",) * len(omega), 0))
        choices.append((sum(float(np.sum(part.error)) for part in parts), parts))
    return min(choices, key=lambda choice: choice[0])[1]


def _alone(waves: WaveImages, omega: Float[Array, " frequencies"]) -> GroupWaves:
    """Images that belong to no pair."""
    value = waves.field(omega)
    return GroupWaves(value, error_of_images(waves, omega), ("images",) * len(omega), 0)


def error_of_images(waves: WaveImages, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
    """The error of images that lie apart."""
    return _OF_IMAGES / omega * float(waves.amplitude.sum())


def summed_error(ring: WaveImages, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
    """The error of neighbours on a ring as a sum."""
    return _error_of_pairs(ring, _gaps(ring), omega, _ON_RING / 2 if len(ring) == 2 else _AT_FOLD)


def apart_error(images: WaveImages, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
    """The error of images as a sum."""
    return summed_error(images, omega) + error_of_images(images, omega)


def _gaps(ring: WaveImages) -> Float[Array, " images"]:
    """Times between each image and the next on the ring, infinite where these are no pair."""
    following = np.roll(np.arange(len(ring)), -1)
    return np.where(ring.index != ring.index[following], np.abs(ring.time - ring.time[following]), math.inf)


def _error_of_pairs(
    ring: WaveImages, gap: Float[Array, " images"], omega: Float[Array, " frequencies"], share: float
) -> Float[Array, " frequencies"]:
    """The error of pairs as sums, by the phase between both."""
    amplitude = np.sqrt(ring.amplitude * np.roll(ring.amplitude, -1))[np.isfinite(gap)]
    chi = gap[np.isfinite(gap)][:, None] * omega / 2
    with np.errstate(divide="ignore"):
        return (amplitude[:, None] * share / chi * (1 + _NEXT_ORDER / chi)).sum(axis=0)


@dataclass(frozen=True, eq=False)
class _BesideCurve:
    """The images beside a critical curve.

    ring: in the order of their position angles; others: of the same indices, but beside the next critical curve; curve:
    the nearest curve of the ring, if it is smooth; order: of the critical curve; caustic: its points, None if they are
    not known; star: direction; nearness: of viewer and source to the hole.
    """

    ring: WaveImages
    others: WaveImages
    curve: NearestCurve | None
    order: int
    caustic: Points | None
    star: Float[Array, " 3"]
    nearness: float

    def best(self, omega: Float[Array, " frequencies"], how: str) -> GroupWaves:
        """The method with the smallest error at each frequency, or the one that is wanted."""
        ways = self._ways(omega)
        if how != "auto":
            ways = {name: ways[name] for name in ((how,) if how in ways else ("images",)) if name in ways}
        if not ways:
            nothing = np.zeros(len(omega))
            return GroupWaves(nothing + 0j, np.full(len(omega), math.inf), ("images",) * len(omega), self.order)
        names = list(ways)
        values, errors = (np.array([ways[name][i] for name in names]) for i in (0, 1))
        best, columns = errors.argmin(axis=0), np.arange(len(omega))
        method = tuple(names[i] for i in best.tolist())
        return GroupWaves(values[best, columns], errors[best, columns], method, self.order)

    def torn(self, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
        """The part that is lost where its images belong to two other groups."""
        apart = summed_error(self.ring, omega) * self._bent + summed_error(self.others, omega)
        return apart + self._beyond_caustic(omega)

    def _ways(self, omega: Float[Array, " frequencies"]) -> dict[str, tuple[Array, Array]]:
        """The waves and their errors, by each method that there is."""
        ring, ways = self.ring, {}
        share = _share(self.order, omega)
        apart = float(np.linalg.norm(ring.amplitude)) if len(ring) else math.inf
        if self.curve is not None:
            value = self.curve.field(omega)
            # What the images would be without their phases, but on a caustic no more than there can be.
            size = np.minimum(np.sqrt(omega) * self.curve.brightest, apart)
            error = share * self.curve.far_off * np.maximum(np.abs(value), size)
            if self.curve.gap is not None:
                hidden = ring[~self.curve.holds(ring.time)]
                value = value + hidden.field(omega)
                error = error + self.curve.lost_in_gap(omega) + apart_error(hidden, omega)
                error = error + beyond_gap(ring, self.curve, self.caustic, self.star, omega)
            ways["line"] = value, error
        if len(ring) == 2 and (self.curve is None or self.curve.gap is not None):
            early = np.argsort(ring.time)
            value = ring_pair(omega, int(ring.index.min()), _two(ring.time[early]), _two(ring.amplitude[early]))
            size = np.sqrt(math.pi * omega * np.ptp(ring.time) / 4) * ring.amplitude.sum()
            error = (share * self._off_axis + self._not_round(omega)) * np.maximum(
                np.abs(value), np.minimum(size, apart)
            )
            ways["ring"] = value * next_order(self.order, omega), error + self._beyond_caustic(omega)
        if len(ring):
            error = summed_error(ring, omega) * self._bent + error_of_images(ring, omega)
            ways["images"] = ring.field(omega), error + self._beyond_caustic(omega)
        if len(ring) > 2:
            for name, way in (("fold", _with_fold), ("cusp", _with_cusp)):
                value, error, around = way(ring, omega, share)
                ways[name] = value, error + self._beyond_caustic(omega, around)
        more, unsure = self.others.field(omega), apart_error(self.others, omega)
        return {
            name: (np.nan_to_num(value) + more, np.nan_to_num(error, nan=math.inf) + unsure)
            for name, (value, error) in ways.items()
        }

    def _size_and_away(self, caustic: Points) -> tuple[float, float]:
        """The distance of the farthest point of a caustic from its middle, and that of the star."""
        middle = caustic.direction.mean(axis=0)
        return float(lengths(caustic.direction - middle).max()), float(np.linalg.norm(self.star - middle))

    @property
    def _bent(self) -> float:
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

    def _not_round(self, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
        """The error of a ring by its field, as its caustic is no point.

        An astroid with cusps at c from its middle is that of a phase omega B c cos(2 psi) / 4 round the ring, B the
        impact parameter. Two images know its values where they are: what is left falls as 1 / x beside the axis, x the
        argument of the Bessel function, and is of second order on it. Their amplitudes are not those of a ring.
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

    def _beyond_caustic(
        self, omega: Float[Array, " frequencies"], around: Float[Array, " images"] | None = None
    ) -> Float[Array, " frequencies"]:
        """The error by a caustic beside the star, on the side without images.

        Waves reach the star from beyond a fold, which fall as the Airy function does; on a fold they grow with the
        sixth root of the frequency. And the image beside a cusp is not alone: its error falls with the phase that it
        would have to others. A caustic that is much smaller than its distance has none of it, nor has that part of it
        which the images at the position angles `around` come from.
        """
        if self.caustic is None or not len(self.ring):
            return np.zeros(len(omega))
        away = _distances(self.caustic, self.star)
        if away.min() > _SMALL * self._size_and_away(self.caustic)[0]:
            return np.zeros(len(omega))
        if around is not None:
            line = self.caustic.line_of_sight
            turn = np.exp(1j * np.arctan2(line[:, 2], line[:, 1]))
            middle = np.exp(1j * around).mean()
            spread = float(np.abs(np.angle(np.exp(1j * around) / middle)).max())
            away = away[np.abs(np.angle(turn / middle)) > spread + _BESIDE_IMAGES]
        return _dark_error(self.ring, float(away.min(initial=math.inf)), omega)


def _distances(caustic: Points, star: Float[Array, " 3"]) -> Float[Array, " points"]:
    """Distances of a star from the sides between points of a caustic, each with the next."""
    place = caustic.direction
    return distance_from_sides(place, np.roll(place, -1, axis=0), np.broadcast_to(star, place.shape))


def _dark_error(ring: WaveImages, nearest: float, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
    """The error of images beside a caustic at some distance that has none there."""
    if not len(ring):
        return np.zeros(len(omega))
    # Next to a fold the amplitudes of its own pair say little, those of the others how bright the ring is.
    bright = float(np.linalg.norm(np.minimum(ring.amplitude, max(1.0, float(ring.amplitude.min())))))
    phase = _DECAY * omega * nearest**1.5
    with np.errstate(divide="ignore"):
        on_fold = _BESIDE_FOLD * np.maximum(omega, 1.0) ** (1 / 6) * bright
        return np.minimum(on_fold * np.exp(-phase) + _BESIDE_CUSP / phase * bright, on_fold)


def beyond_gap(
    ring: WaveImages,
    curve: NearestCurve,
    caustic: Points | None,
    star: Float[Array, " 3"],
    omega: Float[Array, " frequencies"],
) -> Float[Array, " frequencies"]:
    """The error by the part of a caustic that the gap of a nearest curve hides."""
    if caustic is None or curve.gap is None:
        return np.zeros(len(omega))
    away = _distances(caustic, star)[curve.gap.hides(caustic.edge_phase)]
    return _dark_error(ring, float(away.min(initial=math.inf)), omega)


def _two(values: Sequence[float] | Array) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _with_fold(
    ring: WaveImages, omega: Float[Array, " frequencies"], share: Float[Array, " frequencies"]
) -> tuple[Array, Array, Array]:
    """The two neighbours that are closest in time as a pair beside a fold, and all others as images.

    The field, its error, and the position angles of both.
    """
    gap = _gaps(ring)
    first = int(gap.argmin())
    both = [first, (first + 1) % len(ring)]
    pair, rest = ring[np.array(both)], ring[np.delete(np.arange(len(ring)), both)]
    pair = pair[np.argsort(pair.time)]
    with np.errstate(invalid="ignore"):
        value = fold_pair(omega, int(pair.index.min()), _two(pair.time), _two(pair.amplitude))
    # All other neighbours are summed.
    gap[first] = math.inf
    torn = _error_of_pairs(ring, gap, omega, _AT_FOLD)
    own = share * np.maximum(np.abs(value), _airy_scale(pair, omega))
    return value + rest.field(omega), own + torn + error_of_images(rest, omega), pair.around


def _with_cusp(
    ring: WaveImages, omega: Float[Array, " frequencies"], share: Float[Array, " frequencies"]
) -> tuple[Array, Array, Array]:
    """The same of the three neighbours that are closest in time, as images within a cusp."""
    gap = _gaps(ring)
    middle = int(np.maximum(gap, np.roll(gap, 1)).argmin())
    three = np.array([middle - 1, middle, middle + 1]) % len(ring)
    triple, rest = ring[three], ring[np.delete(np.arange(len(ring)), three)]
    index, time, amplitude = triple.index.tolist(), triple.time.tolist(), triple.amplitude.tolist()
    with np.errstate(invalid="ignore"):
        value, size = cusp_triple(omega, (index[1], index[0]), (time[0], time[1], time[2]), tuple(amplitude))
    gap[three[:2]] = math.inf
    torn = _error_of_pairs(ring, gap, omega, _AT_FOLD)
    value = value + rest.field(omega)
    return value, share * np.maximum(size, np.abs(value)) + torn + error_of_images(rest, omega), triple.around


def _airy_scale(pair: WaveImages, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
    """About the amplitude of a pair: that of its images, and next to the fold the largest of the Airy function."""
    chi = omega * float(np.ptp(pair.time)) / 2
    return float(np.linalg.norm(pair.amplitude)) * np.minimum(1.0, np.maximum(chi, 0) ** (1 / 6))


def _share(order: int, omega: Any) -> Any:
    """The error of a ring or a fold by its field."""
    share = (_OF_PRIMARY if order == 1 else _OF_RING) / (omega + _LONG_WAVES)
    return share * (1 + (_LONGEST_WAVES / omega) ** 4)


def ring_error(
    curves: Sequence[NearestCurve], omega: float, size: Float[Array, " places"], ring: WaveImages
) -> Float[Array, " places"]:
    """The error of integrals of a ring whose fields have the given moduli, beside images of one star."""
    return (
        _share(curves[0].order, omega)
        * max(curve.far_off for curve in curves)
        * np.maximum(size, float(np.linalg.norm(np.minimum(ring.amplitude, size.max()))))
    )


def left_out(waves: WaveImages, last: int) -> float:
    """The amplitude of all images of higher index than the last, as it falls from index to index."""
    amplitude = np.nan_to_num(waves.amplitude, posinf=0)
    sums, squares = (np.bincount(waves.index, amplitude**power, HIGHEST_INDEX + 2) for power in (1, 2))
    # Of many images the phases differ.
    roots = np.sqrt(squares)
    sums = np.minimum(sums, _IN_PHASE * roots)
    known = np.flatnonzero(sums)
    if not len(known):
        return 0.0
    highest, count = int(known.max()), np.bincount(waves.index, minlength=HIGHEST_INDEX + 2)
    if highest < 2:
        beyond = _UNKNOWN_RATIO * sums[highest]
    else:
        grows = bool(count[highest] > count[highest - 2])
        size = roots if grows else sums
        ratio = min(size[highest] / size[highest - 2], _LARGEST_RATIO) if size[highest - 2] > 0 else _LARGEST_RATIO
        later = max(ratio, _LEAST_RATIO)
        beyond = _UNSURE[int(grows)] * (ratio * sums[highest - 1] + later * sums[highest]) / (1 - later)
        # Within a caustic images are brighter than those of the next indices can be.
        beyond = min(beyond, sums[highest - 1] + sums[highest])
    within_caustic = count.max() > 1
    return (_MORE if within_caustic else 1.0) * float(sums[last + 1 : highest + 1].sum() + beyond)
