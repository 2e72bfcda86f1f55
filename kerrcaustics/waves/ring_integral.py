"""The integral of a ring of images along its nearest curve, at any frequencies."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.shapes import Bool, Complex, Float
from kerrcaustics.waves.gaps import Gap

Array = np.ndarray

# Phase of the next term of the prefactor of a primary ring, times the frequency.
_NEXT_PHASE = 1 / 24
# Nodes of the sum per radian of the fastest phase.
_PER_RADIAN = 1.2
# Nodes of the sum at zero frequency.
_LEAST_NODES = 40
# Largest ratio of frequencies that share nodes.
_ALIKE = 1.25
# Most nodes of one sum: at higher frequencies there is none.
_MOST_NODES = 1 << 17
# Factor of the number of lines on which stationary places of the phase are searched for.
_FINELY = 8
# Largest difference between the phase at a stationary place and the time of an image on the curve.
_SAME_TIME = 1e-3
# Rate below which a phase is stationary without a change of sign.
_STILL = 0.02
# Least range of the phase, M: on an axis the phase is constant but for round-off.
_TINY = 1e-3
# Largest error of a wave in units of its amplitude, for an unknown phase.
_OPPOSITE = 2.0


@dataclass(frozen=True, eq=False)
class NearestCurve:
    """The integrand of a ring of images, at equally spaced lines.

    order: of the critical curve.
    phase: T - B . n_s.
    phase_error: error of the phase on the lines.
    amplitude: amplitude of the integrand.
    off_axis_factor: ratio of its error to that on the axis.
    roughness: the last Fourier coefficients over the largest.
    is_smooth: True if it is one curve that every line crosses once, but for lines in the gap.
    gap: lines that are left out.
    short_fade: the amplitude that fades faster beside the gap.
    """

    order: int
    phase: Float[Array, " lines"]
    phase_error: float
    amplitude: Float[Array, " lines"]
    off_axis_factor: float
    roughness: float
    is_smooth: bool
    gap: Gap | None = None
    short_fade: Float[Array, " lines"] | None = None

    @property
    def fastest(self) -> float:
        """The largest rate of the phase along the curve."""
        return float(np.abs(rate_of(self.phase)).max())

    @property
    def brightest(self) -> float:
        """The integral of the amplitude, by which the field grows with the root of the frequency at most."""
        return float(self.amplitude.mean()) * math.sqrt(2 * math.pi)

    def nodes(self, omega: float) -> int:
        """Number of nodes that the sum needs at a frequency: with fewer it is wrong, and does not show it."""
        return math.ceil(min(_PER_RADIAN * abs(omega) * self.fastest + _LEAST_NODES, _MOST_NODES))

    @property
    def highest_frequency(self) -> float:
        """The highest frequency at which there is a sum."""
        return (_MOST_NODES - _LEAST_NODES) / (_PER_RADIAN * max(self.fastest, np.finfo(float).tiny))

    def is_slow(self, omega: Float[Array, " frequencies"]) -> Bool[Array, " frequencies"]:
        """True for frequencies above the highest one."""
        return np.abs(omega) > self.highest_frequency

    def field(self, omega: Float[Array, " frequencies"]) -> Complex[Array, " frequencies"]:
        """The sum at frequencies that are not 0; NaN where there is none."""
        return self.field_and_loss(omega)[0]

    def field_and_loss(
        self, omega: Float[Array, " frequencies"]
    ) -> tuple[Complex[Array, " frequencies"], Float[Array, " frequencies"]]:
        """The sum, and its error by the fade beside the gap: the difference between two lengths of the fade."""
        short = self.amplitude if self.short_fade is None else self.short_fade
        value, lost = self._sums(omega, np.stack([self.amplitude, self.amplitude - short]))
        return value, np.abs(lost)

    def error_of_phase(self, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
        """The error of the sum by that of the phase, and by the missing terms of its Fourier series.

        Coefficients fall exponentially: the missing ones are extrapolated from the last quarter.
        """
        lacking = self.roughness ** (4 / 3) * max(float(np.ptp(self.phase)), _TINY)
        off = np.minimum(np.abs(omega) * (self.phase_error + lacking), _OPPOSITE)
        return off * np.sqrt(np.abs(omega)) * self.brightest

    def _sums(
        self, omega: Float[Array, " frequencies"], amplitudes: Float[Array, "2 lines"]
    ) -> Complex[Array, "2 frequencies"]:
        value, ascending = np.full((2, len(omega)), np.nan, complex), np.argsort(np.abs(omega))
        first, known = 0, int((~self.is_slow(omega)).sum())
        # Far from 0 a phase would lose digits in whole turns.
        middle = float(self.phase.mean())
        while first < known:
            # The lower a frequency, the fewer nodes it needs.
            most = _ALIKE * abs(omega[ascending[first]])
            last = int(np.searchsorted(np.abs(omega[ascending[:known]]), most, side="right"))
            count = max(len(self.phase), self.nodes(float(omega[ascending[last - 1]])))
            here = ascending[first:last]
            nodes = np.stack([resampled(part, count) for part in (self.phase - middle, *amplitudes)], axis=1)
            parts = kernel("phase_sums").on_rays((count,), [omega[here]], tables=[nodes])
            value[:, here] = [one + 1j * other for one, other in (parts[:2], parts[2:])]
            value[:, here] /= count
            first = last
        return self.prefactor(omega) * value * np.exp(1j * omega * middle) * (2 * math.pi)

    def holds(self, time: Float[Array, " images"]) -> Bool[Array, " images"]:
        """True for images, by their times, that are stationary places of the sum; others of the ring lie elsewhere."""
        count = _FINELY * len(self.phase)
        step, phase, rate = 2 * math.pi / count, resampled(self.phase, count), resampled(rate_of(self.phase), count)
        kept = np.ones(count, bool) if self.gap is None else ~self.gap.hides(edge_phases(count))
        after = np.roll(rate, -1)
        # Where the rate changes its sign, by a cubic through both lines; on an axis the phase is constant.
        reversals, flat = kept & (rate * after < 0), kept & (np.abs(rate) < _STILL)
        part = rate[reversals] / (rate[reversals] - after[reversals])
        rise = step * part * (rate[reversals] * (1 - part) ** 2 - after[reversals] * part * (1 - part))
        bend = part**2 * (3 - 2 * part) * (np.roll(phase, -1) - phase)[reversals]
        stationary = np.concatenate([phase[reversals] + bend + rise, phase[flat]])
        return np.abs(stationary - time[:, None]).min(axis=1, initial=math.inf) < _SAME_TIME

    def prefactor(self, omega: Any) -> Any:
        """The factor before the integral."""
        turn = np.exp(-0.25j * math.pi - 0.5j * math.pi * (self.order - 1))
        return np.sqrt(omega / (2 * math.pi)) * turn * next_order(self.order, omega)


def next_order(order: int, omega: Any) -> Any:
    """The next order of the asymptotics across a ring as a phase: that of a point mass for the primary one, else 1."""
    return np.exp(1j * _NEXT_PHASE / omega) if order == 1 else 1.0


def edge_phases(count: int) -> Float[Array, " lines"]:
    """Edge phases of equally spaced lines."""
    return 2 * math.pi * np.arange(count) / count


def resampled(values: Float[Array, " lines"], count: int) -> Float[Array, " nodes"]:
    """A periodic function at more equally spaced places, by its Fourier series."""
    if count == len(values):
        return values
    return np.fft.irfft(np.fft.rfft(values), count) * (count / len(values))


def rate_of(values: Array) -> Array:
    """The derivative of a periodic function of 2 pi, by its Fourier series."""
    series = np.fft.rfft(values, axis=0)
    order = np.arange(len(series))
    order[-1] = 0
    return np.fft.irfft((1j * order).reshape(-1, *[1] * (values.ndim - 1)) * series, len(values), axis=0)


def roughness_of(values: Float[Array, " lines"]) -> float:
    """The largest of the last quarter of Fourier coefficients over the largest of all, or that of a tiny function."""
    series = np.abs(np.fft.rfft(values))
    return float(series[-len(series) // 4 :].max() / max(series.max(), _TINY * len(values)))
