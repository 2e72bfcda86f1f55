"""Hot spots that circle the hole, each with a streak."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.scenes.colour import ResponseLike, check_response, seen_black_body
from kerrcaustics.scenes.disk.samples import DiskSamples, Emission
from kerrcaustics.scenes.scene_checks import check_number, not_negative, positive
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.checks import numbers, one_of, quoted

Array = np.ndarray

FADES = ("linear", "quadratic")

# Radius of a spot, standard deviations, beyond which its light is left out.
_DEVIATIONS = 3.5
# Largest factor by which a spot is widened: coarser parts of pixels sample the spots.
_WIDEST = 6.0
# Pairs of a place and a spot that are evaluated together.
_PAIRS = 1 << 18
# Part of a spot's peak below which its light is left out.
_FAINTEST = 1e-3
# Largest size of the parts of pixels, standard deviations of a spot.
_FINE = 1.0
# Largest number of parts of a pixel each way.
_MOST_PARTS = 4


class _Band(NamedTuple):
    """Spots of similar radii, in order of their phases at one moment.

    orbital: mean angular velocity dphi / dt.
    drift: largest deviation from it.
    phase: (k,) azimuths at that moment, radians, ascending.
    number: (k,) numbers of the spots.
    """

    orbital: float
    drift: float
    phase: Array
    number: Array


@dataclass(frozen=True, eq=False)
class Spots(Emission):
    """Round spots on circular orbits, black bodies whose light falls off as a Gaussian; they keep their shape.

    Parameters
    ----------
    radius, azimuth : (n,) arrays
        Radii of their orbits, and azimuths of the spots at time 0.
    temperature : float or (n,) array
        Kelvin.
    size : float
        Standard deviation of a spot's profile, in units of the mass.
    streak : float
        Time over which a spot leaves a streak that fades; 0 for none.
    response : str or MeasuredResponse
        "cie", "film" or measured curves, as for `black_body`.
    brightness : float or (n,) array
        Factor of a spot's light.
    retrograde : bool or (n,) array
        True for spots that circle against the disk's motion.
    fade : str
        Fall of the streak's light with its age s, 0 to 1: "linear", as 1 - s, or "quadratic", as (1 - s)^2; either way
        the total is the same.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    A spot smaller than a part of a pixel is widened to it, and dimmed accordingly: its light stays the same.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.disks.Spots(radius=[8.0, 9.0], azimuth=[0.0, 2.0], size=0.2).size
    0.2
    """

    radius: Any
    azimuth: Any
    temperature: Any = 6504.0
    size: float = 0.1
    streak: float = 0.0
    response: ResponseLike = "cie"
    brightness: Any = 1.0
    retrograde: Any = False
    fade: str = "linear"

    keeps_shape = True

    def __post_init__(self) -> None:
        """Raise ValueError unless the spots are valid."""
        radius, azimuth = numbers("radius", self.radius).ravel(), numbers("azimuth", self.azimuth).ravel()
        if not (len(radius) and np.isfinite(radius).all() and (radius > 0).all()):
            raise ValueError("Argument `radius` must hold positive, finite radii.")
        if not (len(azimuth) == len(radius) and np.isfinite(azimuth).all()):
            raise ValueError(f"Argument `azimuth` must hold {len(radius)} numbers, one for each spot.")
        temperature = numbers("temperature", self.temperature).ravel()
        if not (len(temperature) in (1, len(radius)) and ((temperature > 0) & (temperature <= 1e6)).all()):
            raise ValueError("Argument `temperature` must hold temperatures above 0 and at most 1e6 kelvin.")
        check_number("size", self.size, "be a positive, finite length", positive)
        check_number("streak", self.streak, "be a finite time from 0 on", not_negative)
        check_response(self.response)
        one_of("fade", self.fade, FADES)
        brightness = _each("brightness", self.brightness, len(radius))
        if not (np.isfinite(brightness) & (brightness >= 0)).all():
            raise ValueError("Argument `brightness` must hold finite numbers that are not negative.")
        if np.asarray(self.retrograde).dtype != bool:
            raise ValueError(f"Argument `retrograde` must hold True or False, but is {quoted(self.retrograde)}.")
        retrograde = _each("retrograde", self.retrograde, len(radius)) != 0
        order = np.argsort(radius, kind="stable")
        temperature = np.broadcast_to(temperature, radius.shape)
        columns = {"radius": radius, "azimuth": azimuth, "temperature": temperature, "brightness": brightness}
        for name, values in {**columns, "retrograde": retrograde}.items():
            object.__setattr__(self, name, values[order])

    def parts(self, low: Array, high: Array, size: Array) -> Int[Array, " n"]:
        """The number for which a part is as small as a spot, up to a limit."""
        length = np.maximum(size[:, 0] * float(np.ptp(self.radius) + 1), size[:, 1] * self.radius[-1])
        ratio = np.maximum(length / (_FINE * self.size), 1)
        return np.clip(2 ** np.ceil(np.log2(ratio)), 1, _MOST_PARTS).astype(int)

    def light(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """Linear sRGB light (n, 3)."""
        light = np.zeros((len(samples.radius), 3))
        if not len(light):
            return light
        if self.retrograde.any():
            return self._both_senses(samples, beaming, colour_shift)
        # Standard deviations of the spots convolved with the parts, which are boxes.
        boxes = np.sqrt((np.moveaxis(samples.matrix, 1, 0) ** 2).sum(axis=-1) / 12)
        sizes = [np.minimum(np.hypot(self.size, box), _WIDEST * self.size) for box in boxes]
        reaches = [_DEVIATIONS * size for size in sizes]
        time = float(np.median(samples.time))
        rates = samples.orbital(self.radius)
        for ring in self._rings(rates, time):
            for place, spot in _pairs(self, ring, samples, time, reaches):
                profile = self._profile(samples, place, spot, rates[spot], (sizes[0][place], sizes[1][place]))
                bright = profile > _FAINTEST
                place, spot, profile = place[bright], spot[bright], profile[bright]
                shifts = samples.redshift[place], beaming, colour_shift
                colour = seen_black_body(self.temperature[spot], *shifts, self.response)
                coloured = (profile * self.brightness[spot])[:, None] * colour
                for channel in range(3):
                    light[:, channel] += np.bincount(place, coloured[:, channel], minlength=len(light))
        return light

    def _both_senses(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """Linear sRGB light (n, 3) of spots of both senses; 0 where both motions are impossible."""
        counter_rotating = samples.opposite(samples)
        light = np.zeros((len(samples.radius), 3))
        for against, moving in ((False, samples), (True, counter_rotating)):
            chosen = self.retrograde == against
            if chosen.any():
                columns = ("radius", "azimuth", "temperature", "brightness")
                some = replace(self, retrograde=False, **{name: getattr(self, name)[chosen] for name in columns})
                light += np.nan_to_num(some.light(moving, beaming, colour_shift))
        return light

    def _rings(self, orbital: Float[Array, " spots"], time: float) -> list[_Band]:
        """The spots, by radius: each ring is as wide as a spot."""
        edges = np.arange(self.radius[0], self.radius[-1] + 2 * self.size, 2 * self.size)
        starts = np.searchsorted(self.radius, edges)
        rings = []
        for first, last in zip(starts, np.append(starts[1:], len(self.radius)), strict=True):
            if first == last:
                continue
            rates = orbital[first:last]
            middle = float(rates.mean())
            phase = np.mod(self.azimuth[first:last] + rates * time, 2 * math.pi)
            order = np.argsort(phase)
            drift = float(np.abs(rates - middle).max())
            rings.append(_Band(middle, drift, phase[order], np.arange(first, last)[order]))
        return rings

    def _profile(
        self, samples: DiskSamples, place: Array, spot: Array, orbital: Array, sizes: tuple[Array, Array]
    ) -> Float[Array, " pairs"]:
        """Light (pairs,) at places of spots, in units of a spot's peak."""
        from scipy.special import ndtr

        across, along = sizes
        radius = samples.radius[place]
        turn = samples.azimuth[place] - self.azimuth[spot] - orbital * samples.time[place]
        length = radius * (np.mod(turn + math.pi, 2 * math.pi) - math.pi)
        fall = np.exp(-(((radius - self.radius[spot]) / across) ** 2) / 2) * self.size**2 / (across * along)
        if self.streak == 0:
            return fall * np.exp(-((length / along) ** 2) / 2)
        trail, behind = radius * orbital * self.streak / along, length / along
        if self.fade == "quadratic":
            return fall * quadratic_streak(behind, trail)
        # The mean over the streak of a Gaussian times 2 (1 - s) for s in 0 to 1.
        trail = np.where(np.abs(trail) < 1e-6, 1e-6, trail)
        whole = ndtr(behind + trail) - ndtr(behind)
        edges = np.exp(-(behind**2) / 2) - np.exp(-((behind + trail) ** 2) / 2)
        moment = edges / math.sqrt(2 * math.pi) - behind * whole
        return fall * math.sqrt(2 * math.pi) * 2 * (whole / trail - moment / trail**2)


def quadratic_streak(behind: Float[Array, " pairs"], length: Float[Array, " pairs"]) -> Float[Array, " pairs"]:
    """The mean of exp(-(behind + length s)^2 / 2) times 3 (1 - s)^2 over s in 0 to 1.

    With y = behind + length s it is an integral of a square times a Gaussian. For short streaks Gauss's quadrature
    replaces the closed form, which is a difference of large numbers.
    """
    from scipy.special import ndtr

    places, weights = np.polynomial.legendre.leggauss(8)
    s, weights = (1 + places) / 2, weights / 2
    short = np.exp(-((behind[:, None] + length[:, None] * s) ** 2) / 2) @ (3 * (1 - s) ** 2 * weights)
    long = np.where(np.abs(length) < 1, 1.0, length)
    end = behind + long
    whole = math.sqrt(2 * math.pi) * (ndtr(end) - ndtr(behind))
    # Integrals of (end - y)^2 exp(-y^2 / 2), by parts.
    first, last = np.exp(-(behind**2) / 2), np.exp(-(end**2) / 2)
    square = (end**2 + 1) * whole + (behind - 2 * end) * first + end * last
    return np.where(np.abs(length) < 1, short, 3 * square / long**3)


def _each(name: str, values: Any, count: int) -> Float[Array, " spots"]:
    """A number for each spot, from one number or an array."""
    array = numbers(name, values).ravel()
    if len(array) not in (1, count):
        raise ValueError(f"Argument `{name}` must hold one number, or {count}, one for each spot.")
    return np.broadcast_to(array, count)


def _pairs(
    spots: Spots, ring: _Band, samples: DiskSamples, time: float, reaches: list[Array]
) -> Iterator[tuple[Int[Array, " pairs"], Int[Array, " pairs"]]]:
    """Places and spots of a ring that may be close; reaches: radii of the spots at each place, across and along."""
    first, last = spots.radius[ring.number.min()], spots.radius[ring.number.max()]
    across, along = reaches
    near = np.flatnonzero((samples.radius > first - across) & (samples.radius < last + across))
    later = samples.time[near] - time
    phase = np.mod(samples.azimuth[near] - ring.orbital * later, 2 * math.pi)
    half = along[near] / samples.radius[near] + ring.drift * np.abs(later)
    streak = abs(ring.orbital) * spots.streak
    behind, ahead = (half, half + streak) if ring.orbital > 0 else (half + streak, half)
    around = np.concatenate([ring.phase - 2 * math.pi, ring.phase, ring.phase + 2 * math.pi])
    number = np.tile(ring.number, 3)
    start, stop = np.searchsorted(around, phase - behind), np.searchsorted(around, phase + ahead)
    count = np.minimum(stop - start, len(ring.number))
    for part in np.array_split(np.arange(len(near)), count.sum() // _PAIRS + 1):
        counts = count[part]
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        yield np.repeat(near[part], counts), number[np.repeat(start[part], counts) + within]
