"""Pairs of images as one wave, finite where they meet: Airy functions at folds, Bessel functions at axial caustics.

Both are functions of the pair's own times and amplitudes (Chester, Friedman & Ursell 1957, Proc. Camb. Phil. Soc. 53,
599; Ludwig 1966, Comm. Pure Appl. Math. 19, 215).
"""

import math

import numpy as np
import scipy
from jaxtyping import Float

Array = np.ndarray


def fold_pair(
    omega: Float[Array, " frequencies"], index: int, time: tuple[float, float], amplitude: tuple[float, float]
) -> Float[Array, " frequencies"]:
    """The field of two images beside a fold, of which `index` is the lower index and the earlier time comes first."""
    chi = omega * (time[1] - time[0]) / 2
    z = (1.5 * chi) ** (2 / 3)
    value, slope, *_ = scipy.special.airy(-z)
    return _joined(omega, index, time, amplitude, z**0.25 * value, z**-0.25 * slope)


def ring_pair(
    omega: Float[Array, " frequencies"], index: int, time: tuple[float, float], amplitude: tuple[float, float]
) -> Float[Array, " frequencies"]:
    """The same of the only two images of a ring, across the axis from each other."""
    chi = omega * (time[1] - time[0]) / 2
    size = np.sqrt(chi / 2)
    return _joined(omega, index, time, amplitude, size * scipy.special.j0(chi), size * scipy.special.j1(chi))


def _joined(
    omega: Float[Array, " frequencies"],
    index: int,
    time: tuple[float, float],
    amplitude: tuple[float, float],
    even: Float[Array, " frequencies"],
    odd: Float[Array, " frequencies"],
) -> Float[Array, " frequencies"]:
    """Functions of the phase between two images, by the sum and the difference of their amplitudes."""
    turn = np.exp(1j * (omega * sum(time) / 2 - math.pi * index / 2 - math.pi / 4))
    return math.sqrt(math.pi) * turn * (sum(amplitude) * even - 1j * (amplitude[0] - amplitude[1]) * odd)
