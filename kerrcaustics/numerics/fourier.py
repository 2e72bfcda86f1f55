"""Periodic functions through values at even steps, by their Fourier coefficients.

The nodes are (j + 1/2) 2 pi / n. Values may have further axes after the first one.
"""

import numpy as np

from kerrcaustics.shapes import Complex, Float

Array = np.ndarray


def nodes(count: int) -> Float[Array, " count"]:
    """The nodes over one turn."""
    return 2 * np.pi * (np.arange(count) + 0.5) / count


def coefficients(values: Float[Array, " nodes *axes"]) -> Complex[Array, " waves *axes"]:
    """Coefficients c of f(x) = Re sum c_m exp(i m x), from an even number of values at the nodes."""
    count = len(values)
    waves = np.arange(count // 2 + 1)
    weight = np.where((waves == 0) | (waves == count / 2), 1.0, 2.0) * np.exp(-1j * np.pi * waves / count) / count
    return np.fft.rfft(values, axis=0) * _column(weight, values)


def resampled(series: Complex[Array, " waves *axes"], count: int, derivative: int = 0) -> Float[Array, " count *axes"]:
    """Values, or derivatives, at another number of nodes; waves that these cannot hold are left out."""
    waves = np.arange(min(len(series), count // 2 + 1))
    single = (waves == 0) | (waves == count / 2)
    factor = (1j * waves) ** derivative * np.exp(1j * np.pi * waves / count) * count / np.where(single, 1, 2)
    padded = np.zeros((count // 2 + 1, *series.shape[1:]), complex)
    padded[: len(waves)] = series[: len(waves)] * _column(factor, series)
    return np.fft.irfft(padded, count, axis=0)


def values_at(
    series: Complex[Array, " waves *axes"], place: Float[Array, " places"], derivative: int = 0
) -> Float[Array, " places *axes"]:
    """Values, or derivatives, at any places."""
    waves = np.arange(len(series))
    turned = np.exp(1j * np.multiply.outer(place, waves)) * (1j * waves) ** derivative
    return np.real(np.tensordot(turned, series, axes=1))


def _column(factor: Array, values: Array) -> Array:
    return factor.reshape(-1, *[1] * (values.ndim - 1))
