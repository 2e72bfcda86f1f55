"""Sums of images, as if they were apart or in pairs, their errors, and that of images that are left out."""

import math

import numpy as np

from kerrcaustics.lens_map.arguments import HIGHEST_INDEX
from kerrcaustics.shapes import Bool, Complex, Float
from kerrcaustics.waves.uniform import fold_field, fold_parameters
from kerrcaustics.waves.wave_images import WaveImages

Array = np.ndarray

# Error times the frequency, in parts of the field, of separate images.
_OF_IMAGES = 0.01
AT_FOLD = 0.14
"""Error of the sum of two images at a fold, in units of their amplitude, times half the phase between them."""
# The same on a ring.
_ON_RING = 0.18
# Coefficient of the next order in the inverse phase.
_NEXT_ORDER = 0.7
# The most by which a sum of two images is wrong, in parts of both amplitudes: next to a caustic they grow without
# limit, and their uniform field does not.
_MOST = 1.0
# Largest amplitude of many images of one index, in units of the root of the sum of their squares.
_LARGEST_COHERENCE = 2.0
# Least ratio of the amplitude of an index to that of two before, whose images lie on the same side.
_LEAST_RATIO = 0.05
# Largest ratio of these amplitudes.
_LARGEST_RATIO = 0.8
# Ratio of the amplitude of all higher indices to that of the highest one where no more is known.
_UNKNOWN_RATIO = 0.75
# Factors of the extrapolated rest: where indices have the same number of images, and where the number grows.
_SAFETY_FACTORS = (1.25, 2.5)
# Factor of the whole where stars are within caustics.
_CAUSTIC_FACTOR = 1.3


def separate_error(waves: WaveImages, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
    """The error of images that lie apart."""
    return _OF_IMAGES / omega * float(waves.amplitude.sum()) + waves.error(omega)


def ring_sum_error(ring: WaveImages, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
    """The error of neighbours on a ring as a sum."""
    return pair_sum_error(ring, delays_to_next(ring), omega, _ON_RING / 2 if len(ring) == 2 else AT_FOLD)


def image_sum_error(images: WaveImages, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
    """The error of images as a sum."""
    return ring_sum_error(images, omega) + separate_error(images, omega)


def delays_to_next(ring: WaveImages) -> Float[Array, " images"]:
    """Times between each image and the next on the ring, infinite where these are no pair."""
    following = np.roll(np.arange(len(ring)), -1)
    return np.where(ring.index != ring.index[following], np.abs(ring.time - ring.time[following]), math.inf)


def pair_sum_error(
    ring: WaveImages, gap: Float[Array, " images"], omega: Float[Array, " frequencies"], coefficient: float
) -> Float[Array, " frequencies"]:
    """The error of neighbours with finite delays_to_next as sums, by the phase between both."""
    pairs = np.isfinite(gap)
    one, other = ring.amplitude[pairs], np.roll(ring.amplitude, -1)[pairs]
    half_phase = gap[pairs][:, None] * omega / 2
    with np.errstate(divide="ignore", over="ignore"):
        off = np.sqrt(one * other)[:, None] * coefficient / half_phase * (1 + _NEXT_ORDER / half_phase)
    return np.minimum(off, _MOST * (one + other)[:, None]).sum(axis=0)


def unresolved_part(
    ring: WaveImages, meeting: int, omega: Float[Array, " frequencies"]
) -> Float[Array, " frequencies"]:
    """The part, 0 to 1, of the uniform field of the first images of a ring that is in doubt.

    Waves that do not resolve the phases between these and the others of the ring see the whole caustic at once: the
    field of one of its folds or cusps alone is then no approximation. meeting: number of the first images.
    """
    apart = delays_to_next(ring)[meeting - 1 :].min(initial=math.inf)
    half_phase = np.maximum(apart * omega / 2, np.finfo(float).tiny)
    with np.errstate(over="ignore"):
        off = AT_FOLD / half_phase * (1 + _NEXT_ORDER / half_phase)
    return np.minimum(off, 1.0) ** 2


def field_in_pairs(
    ring: WaveImages,
    taken: Bool[Array, " images"],
    omega: Float[Array, " frequencies"],
    relative_error: Float[Array, " frequencies"],
) -> tuple[Complex[Array, " frequencies"], Float[Array, " frequencies"]]:
    """The field of images of a ring and its error: of neighbours, the closest in time first, as pairs beside folds.

    At frequencies at which the error of the sum is smaller, both are summed, as are those that are in no pair.

    taken: True for neighbours whose field is known; relative_error: that of the field of a pair.
    """
    gap, free = delays_to_next(ring), ~taken
    gap[taken & np.roll(taken, -1)] = math.inf
    # Of two images alone there is one pair, not two.
    gap[len(gap) - (len(gap) == 2) :] = math.inf
    value, error = np.zeros(len(omega), complex), np.zeros(len(omega))
    for first in np.argsort(gap).tolist():
        both = np.array([first, (first + 1) % len(ring)])
        if math.isfinite(gap[first]) and free[both].all():
            free[both] = False
            pair = ring[both][np.argsort(ring.time[both])]
            here, off = _pair(pair, omega, relative_error)
            value, error, gap[first] = value + here, error + off, math.inf
    rest = ring[free]
    split_error = pair_sum_error(ring, gap, omega, AT_FOLD)
    return value + rest.field(omega), error + separate_error(rest, omega) + split_error


def _pair(
    pair: WaveImages, omega: Float[Array, " frequencies"], relative_error: Float[Array, " frequencies"]
) -> tuple[Complex[Array, " frequencies"], Float[Array, " frequencies"]]:
    """The field of two images, the earlier one first, and its error, with Airy functions or without."""
    value, size = fold_field(omega, int(pair.index.min()), fold_parameters(pair.time, pair.amplitude))
    error = np.nan_to_num(relative_error * np.maximum(np.abs(value), size) + pair.error(omega), nan=math.inf)
    gap = np.array([np.ptp(pair.time), math.inf])
    summed = pair_sum_error(pair, gap, omega, AT_FOLD) + separate_error(pair, omega)
    return np.where(error < summed, value, pair.field(omega)), np.minimum(error, summed)


def omitted_amplitude(waves: WaveImages, last: int) -> float:
    """The amplitude of all images of higher index than the last, as it falls from index to index."""
    amplitude = np.nan_to_num(waves.amplitude, posinf=0)
    sums, squares = (np.bincount(waves.index, amplitude**power, HIGHEST_INDEX + 2) for power in (1, 2))
    # Of many images the phases differ.
    roots = np.sqrt(squares)
    sums = np.minimum(sums, _LARGEST_COHERENCE * roots)
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
        beyond = _SAFETY_FACTORS[int(grows)] * (ratio * sums[highest - 1] + later * sums[highest]) / (1 - later)
        # Within a caustic images are brighter than those of the next indices can be.
        beyond = min(beyond, sums[highest - 1] + sums[highest])
    within_caustic = count.max() > 1
    return (_CAUSTIC_FACTOR if within_caustic else 1.0) * float(sums[last + 1 : highest + 1].sum() + beyond)
