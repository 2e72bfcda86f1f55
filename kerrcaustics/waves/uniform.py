"""Pairs of images as one wave, finite where they meet: Airy functions at folds, Bessel functions at axial caustics.

Both are functions of the pair's own times and amplitudes (Chester, Friedman & Ursell 1957, Proc. Camb. Phil. Soc. 53,
599; Ludwig 1966, Comm. Pure Appl. Math. 19, 215).
"""

import math

import numpy as np
import scipy
from jaxtyping import Float

Array = np.ndarray
_Waves = Float[Array, "*frequencies"]


def fold_pair(
    omega: Float[Array, " frequencies"], index: int, time: tuple[float, float], amplitude: tuple[float, float]
) -> Float[Array, " frequencies"]:
    """The field of two images beside a fold, of which `index` is the lower index and the earlier time comes first."""
    mean, half = sum(time) / 2, (time[1] - time[0]) / 2
    chi = omega * half
    z = (1.5 * chi) ** (2 / 3)
    value, slope, *_ = scipy.special.airy(-z)
    both, apart = amplitude[0] + amplitude[1], amplitude[0] - amplitude[1]
    turn = np.exp(1j * (omega * mean - math.pi * index / 2 - math.pi / 4))
    return math.sqrt(math.pi) * turn * (both * z**0.25 * value - 1j * apart * z**-0.25 * slope)


def ring_pair(
    omega: Float[Array, " frequencies"], index: int, time: tuple[float, float], amplitude: tuple[float, float]
) -> Float[Array, " frequencies"]:
    """The same of the only two images of a ring, across the axis from each other."""
    mean, half = sum(time) / 2, (time[1] - time[0]) / 2
    chi = omega * half
    both, apart = amplitude[0] + amplitude[1], amplitude[0] - amplitude[1]
    turn = np.exp(1j * (omega * mean - math.pi * index / 2 - math.pi / 4))
    bessel = both * scipy.special.j0(chi) - 1j * apart * scipy.special.j1(chi)
    return np.sqrt(math.pi * chi / 2) * turn * bessel
