"""Images as one wave, finite where they meet: at folds, axial caustics and cusps.

Airy functions, Bessel functions, and Pearcey's integral: all are functions of the images' own times and amplitudes
(Chester, Friedman & Ursell 1957, Proc. Camb. Phil. Soc. 53, 599; Ludwig 1966, Comm. Pure Appl. Math. 19, 215; Pearcey
1946, Phil. Mag. 37, 311).
"""

import math

import numpy as np
import scipy
from jaxtyping import Complex, Float

Array = np.ndarray

# Nodes of Pearcey's integral on the path on which its integrand falls as exp(-s^4), and the last ones; what round-off
# may cost there. Imaginary parts of roots below this part of them are round-off.
_NODES, _LAST, _LOST, _REAL = 600, 6.0, 1e-6, 1e-8


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
    """The field of the only two images of a ring, across the axis from each other."""
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


def cusp_triple(
    omega: Float[Array, " frequencies"],
    index: tuple[int, int],
    time: tuple[float, float, float],
    amplitude: tuple[float, float, float],
) -> tuple[Float[Array, " frequencies"], Float[Array, " frequencies"]]:
    """The field of three images within a cusp, and about its size; NaN where round-off would spoil it.

    index: Morse index of the image in the middle, and of the other two; time, amplitude: the middle one second.
    """
    sense = index[0] - index[1]
    first, last = sense * (time[1] - time[0]), sense * (time[1] - time[2])
    nothing = np.full(len(omega), np.nan)
    if not (first > 0 and last > 0):
        return nothing, nothing
    # The phase t^4 + x t^2 + y t has its stationary places where the images are.
    ratio = last / first
    part = max(root.real for root in np.roots([1, 2, 0, -2 * ratio, -ratio]) if abs(root.imag) < _REAL * abs(root))
    u = (3 * omega * first / (1 + 2 * part)) ** 0.25
    places = u[:, None] * np.array([2 + part, part - 1, -1 - 2 * part]) / 3
    one, middle, three = places.T
    x, y = 2 * (one * middle + one * three + middle * three), -4 * one * middle * three
    phase = omega * time[1] - sense * (x * middle**2 / 2 + 3 * y * middle / 4)
    values = np.array(amplitude) * np.sqrt(np.abs(12 * places**2 + 2 * x[:, None]) / (2 * math.pi))
    share = np.linalg.solve(places[..., None] ** np.arange(3), values[..., None])[..., 0]
    integrals = pearcey(x, y)
    terms = share * (integrals if sense > 0 else integrals.conj())
    turn = np.exp(1j * (phase - math.pi * index[1] / 2 - sense * math.pi / 4))
    return turn * terms.sum(axis=1), np.abs(terms).sum(axis=1)


def pearcey(x: Float[Array, " n"], y: Float[Array, " n"]) -> Complex[Array, "n 3"]:
    """Integrals over t of 1, t and t^2 times exp(i (t^4 + x t^2 + y t)); NaN where round-off would spoil them."""
    s = np.linspace(-_LAST, _LAST, _NODES)
    t = s * np.exp(0.125j * math.pi)
    exponent = 1j * (t**4 + x[:, None] * t**2 + y[:, None] * t)
    lost = exponent.real.max(axis=1) > math.log(_LOST / np.finfo(float).eps)
    value = np.exp(np.where(lost[:, None], np.nan, exponent)) @ (t[:, None] ** np.arange(3))
    return value * (t[1] - t[0])
