"""The primary caustic tube of a far observer, cut at given distances behind the hole; for the study far_camera.

On each of a number of half-lines from the direction of the hole's centre, the ray whose first conjugate point lies at
the wanted radius is found by secant steps. (`kc.caustic_tubes` meets a radius to a few hundredths only.)
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, rfft

import kerrcaustics as kc

from ..measured import Measured

Array = np.ndarray

# The observer is so far away that its distance changes a width by no more than 4 r / distance of itself.
_DISTANCE = 1e8
_LINES, _PLACES, _DENSER = 96, 24, 64
_MOST_SECANTS, _FIRST_STEP, _FOUND = 12, 0.02, 1e-12
# Part of itself by which the radius of a conjugate point is uncertain.
_RADIUS_ERROR = 2e-11


@dataclass(frozen=True)
class Section:
    """The tube at one radius behind the hole.

    spin, inclination (degrees, of the observer), radius; across, along: full widths in theta and in phi times
    sin(inclination), as angles seen from the hole's centre, times radius^2 / (spin sin(inclination))^2, which makes
    their limit a number.
    """

    spin: float
    inclination: float
    radius: float
    across: Measured
    along: Measured


def section(spin: float, inclination: float, radius: float) -> Section:
    """The section of the tube at a radius of 15 or more and far less than 1e8; ValueError where it is not found."""
    camera = kc.Camera(spin, _DISTANCE, math.radians(inclination), velocity="fiducial")
    side = 2 * math.pi * np.arange(_LINES) / _LINES

    def conjugate(log_impact: Array) -> tuple[Array, Array, Array]:
        tilt = np.exp(log_impact) / _DISTANCE
        sky = np.stack([-np.sqrt(1 - tilt**2), tilt * np.cos(side), tilt * np.sin(side)], axis=-1)
        found = kc.ray_paths(camera, sky, _PLACES).conjugate
        return np.log(found.radius[..., 0] / radius), found.theta[..., 0], found.azimuth[..., 0]

    # b^2 = 4 r is the Einstein ring of a far lens.
    before = np.full(_LINES, 0.5 * math.log(4 * radius))
    here = before + _FIRST_STEP
    miss_before, (miss, theta, azimuth) = conjugate(before)[0], conjugate(here)
    for _ in range(_MOST_SECANTS):
        if np.abs(miss).max() < _FOUND:
            break
        moved = miss != miss_before
        step = np.where(moved, miss * (here - before) / np.where(moved, miss - miss_before, 1.0), 0.0)
        before, here, miss_before = here, here - step, miss
        miss, theta, azimuth = conjugate(here)
    if not np.abs(miss).max() < _FOUND:
        raise ValueError(f"Argument `radius` must be 15 or more and far below {_DISTANCE:g}, but is {radius}.")
    # Rays on the two sides of the hole come with azimuths that differ by a whole turn.
    azimuth = np.unwrap(azimuth)
    sine = math.sin(math.radians(inclination))
    scale = (radius / (spin * sine)) ** 2
    # Across the ring a ray moves by twice what its impact parameter, 2 sqrt(r), does.
    noise = 4 * _RADIUS_ERROR / math.sqrt(radius)
    widths = [_width(angle, scale, noise) for angle in (theta, azimuth * sine)]
    return Section(spin, inclination, radius, widths[0], widths[1])


def _width(angle: Array, scale: float, noise: float) -> Measured:
    """Full width of a closed curve in one angle, along its trigonometric series; half of the lines give the error."""
    widths = [np.ptp([_extreme(every), -_extreme(-every)]) for every in (angle, angle[::2])]
    return Measured(float(scale * widths[0]), float(scale * (abs(widths[0] - widths[1]) + noise)))


def _extreme(values: Array) -> float:
    """Largest value of the trigonometric series through values at even steps of a circle."""
    dense = irfft(rfft(values) * _DENSER, _DENSER * len(values))
    top = int(dense.argmax())
    left, middle, right = dense[[top - 1, top, (top + 1) % len(dense)]]
    bend = left - 2 * middle + right
    return float(middle - (right - left) ** 2 / (8 * bend)) if bend < 0 else float(middle)
