"""Images as one wave, finite where they meet: at folds, axial caustics and cusps.

Airy functions, Bessel functions, and Pearcey's integral: all are functions of the images' own times and amplitudes
(Chester, Friedman & Ursell 1957, Proc. Camb. Phil. Soc. 53, 599; Ludwig 1966, Comm. Pure Appl. Math. 19, 215; Pearcey
1946, Phil. Mag. 37, 311).
"""

import math

import numpy as np

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.shapes import Complex, Float

Array = np.ndarray

# Nodes of Pearcey's integral on the path on which its integrand falls as exp(-s^4).
_NODES = 600
# |s| of the last nodes.
_LAST = 6.0
# Largest loss by round-off in that integral.
_LOST = 1e-6
# Imaginary part of a root, in parts of the root, below which it is round-off.
_REAL = 1e-8
# Largest argument of Airy functions: their leading terms beyond it are the sum of two images.
_FARTHEST = 1e4


def fold_parameters(time: Float[Array, " 2"], amplitude: Float[Array, " 2"]) -> Float[Array, " 4"]:
    """Parameters of the field of two images beside a fold, the earlier one first.

    Their mean time; the argument of the Airy functions, the sum and the difference of the amplitudes, without the
    powers of the frequency that belong to them. All four are analytic in the place of the source, through the fold.
    NaN where both images are one.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        argument = (0.75 * (time[1] - time[0])) ** (2 / 3)
        even, odd = amplitude.sum() * argument**0.25, (amplitude[0] - amplitude[1]) * argument**-0.25
    return np.array([time.mean(), argument, even, odd])


def fold_field(
    omega: Float[Array, " frequencies"], index: int, parameters: Float[Array, " 4"]
) -> tuple[Complex[Array, " frequencies"], Float[Array, " frequencies"]]:
    """The field beside a fold and its approximate size, NaN where arguments are too large.

    index: the lower Morse index. The size is that of both images without their phases, and next to the fold the largest
    value of the Airy function.
    """
    from scipy.special import airy

    mean, argument, even, odd = parameters.tolist()
    z = omega ** (2 / 3) * argument
    value, slope, *_ = airy(-np.where(np.abs(z) < _FARTHEST, z, np.nan))
    turn = np.exp(1j * (omega * mean - math.pi * index / 2 - math.pi / 4))
    field = math.sqrt(math.pi) * turn * (even * omega ** (1 / 6) * value - 1j * odd * omega ** (-1 / 6) * slope)
    return field, abs(even) / math.sqrt(2) * omega ** (1 / 6) / np.maximum(1, z) ** 0.25


def ring_pair(
    omega: Float[Array, " frequencies"], index: int, time: Float[Array, " 2"], amplitude: Float[Array, " 2"]
) -> Complex[Array, " frequencies"]:
    """The field of the only two images of a ring, across the axis from each other, the earlier one first.

    index: the lower Morse index.
    """
    from scipy.special import j0, j1

    chi = omega * (time[1] - time[0]) / 2
    even, odd = j0(chi), j1(chi)
    turn = np.exp(1j * (omega * time.mean() - math.pi * index / 2 - math.pi / 4))
    return np.sqrt(math.pi * chi / 2) * turn * (amplitude.sum() * even - 1j * (amplitude[0] - amplitude[1]) * odd)


def cusp_parameters(sense: int, time: Float[Array, " 3"], amplitude: Float[Array, " 3"]) -> Float[Array, " 6"]:
    """Parameters of the field of three images within a cusp, in their order round the hole.

    sense: 1 if the image in the middle has the higher index, -1 if it has the lower one. The parameters are the phase,
    x and y of Pearcey's integral, and the shares of its three moments, without the powers of the frequency that belong
    to them. All are analytic in the place of the source, through the cusp. NaN where the times are not those of images
    within a cusp.
    """
    first, last = sense * (time[1] - time[0]), sense * (time[1] - time[2])
    if not (first > 0 and last > 0):
        return np.full(6, np.nan)
    # The phase t^4 + x t^2 + y t has its stationary places where the images are.
    ratio = last / first
    part = max(root.real for root in np.roots([1, 2, 0, -2 * ratio, -ratio]) if abs(root.imag) < _REAL * abs(root))
    u = (3 * first / (1 + 2 * part)) ** 0.25
    places = u * np.array([2 + part, part - 1, -1 - 2 * part]) / 3
    one, middle, three = places.tolist()
    x, y = 2 * (one * middle + one * three + middle * three), -4 * one * middle * three
    phase = time[1] - sense * (x * middle**2 / 2 + 3 * y * middle / 4)
    values = amplitude * np.sqrt(np.abs(12 * places**2 + 2 * x) / (2 * math.pi))
    return np.array([phase, x, y, *np.linalg.solve(places[:, None] ** np.arange(3), values)])


def cusp_field(
    omega: Float[Array, " frequencies"], index: tuple[int, int], parameters: Float[Array, " 6"]
) -> tuple[Complex[Array, " frequencies"], Float[Array, " frequencies"]]:
    """The field beside a cusp, and about its size; NaN where round-off would spoil it.

    index: Morse index of the image in the middle, and of the other two.
    """
    sense = index[0] - index[1]
    phase, x, y, *shares = parameters.tolist()
    share = np.array(shares) * omega[:, None] ** (0.25 - 0.25 * np.arange(3))
    integrals = pearcey(omega**0.5 * x, omega**0.75 * y)
    terms = share * (integrals if sense > 0 else integrals.conj())
    turn = np.exp(1j * (omega * phase - math.pi * index[1] / 2 - sense * math.pi / 4))
    return turn * terms.sum(axis=1), np.abs(terms).sum(axis=1)


def pearcey(x: Float[Array, " n"], y: Float[Array, " n"]) -> Complex[Array, "n 3"]:
    """Integrals over t of 1, t and t^2 times exp(i (t^4 + x t^2 + y t)); NaN where round-off would spoil them."""
    s = np.linspace(-_LAST, _LAST, _NODES)
    t = s * np.exp(0.125j * math.pi)
    powers = np.stack([part for power in (t, t**2, t**4) for part in (power.real, power.imag)], axis=1)
    largest, *parts = kernel("moments").on_rays((len(t),), [x, y], tables=[powers])
    value = np.stack([one + 1j * other for one, other in zip(parts[::2], parts[1::2], strict=True)], axis=1)
    value[~(largest <= math.log(_LOST / np.finfo(float).eps))] = np.nan
    return value * (t[1] - t[0])
