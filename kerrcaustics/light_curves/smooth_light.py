"""The light of a ball's images far from folds: the area within the image of its limb, by Green's theorem.

Rays past places all round the limb surround the image once. Its solid angle is the integral of u x du / 2 about the ray
past the middle, u being Lambert's equal-area coordinates. It depends on the places of these rays on the sky alone, not
on derivatives, so that the axes across the ray may turn from ray to ray. g^4 is approximated by a polynomial of the
second degree in u, with its values on the limb and in the middle.
"""

import math

import numpy as np

from kerrcaustics.light_curves.arrivals import along_sky, solutions
from kerrcaustics.light_curves.ball_passes import Passes, RayAims
from kerrcaustics.light_curves.balls import MovingBall
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.sphere import tangent_basis

Array = np.ndarray

# Rays past the limb: twice an odd number, so that each half of them is odd and has no wave of zero slope at all places.
_RAYS = 14
# Largest factor by which the light of a point may change over the ball: else slices are needed.
_SMOOTH = 1.3


def smooth_light(ball: MovingBall, aims: RayAims) -> tuple[Float[Array, " n"], Float[Array, " n"], Bool[Array, " n"]]:
    """Flux of images, its error, and True where the image is smooth enough for it.

    The error is the largest change with every other ray, that of the polynomial, and the relative error of rays.
    """
    n, angle = len(aims), np.arange(_RAYS) * 2 * np.pi / _RAYS
    limb = np.tile(ball.size * np.stack([np.cos(angle), np.sin(angle)], axis=-1), (n, 1))
    middle, many = ball.passes(aims), aims[np.repeat(np.arange(n), _RAYS)]
    slope = np.repeat(middle.by_sky, _RAYS, axis=0)
    # Begun where the linear map has them.
    start = many.with_directions(along_sky(many.sky, np.nan_to_num(solutions(slope, limb))), many.time)
    passes, good = ball.rays_through(start, limb)
    smooth = good.reshape(n, -1).all(axis=1) & _is_smooth(middle, passes)
    place = _from_middle(middle, passes, limb)
    light = passes.light.reshape(n, -1)
    smooth &= np.isfinite(place).all(axis=(1, 2)) & np.isfinite(light).all(axis=1)
    flux, error = np.full(n, np.nan), np.full(n, np.nan)
    rows = np.flatnonzero(smooth)
    linear = (place[rows] @ np.swapaxes(middle.by_sky[rows], 1, 2)) / ball.size
    parts = [slice(None), slice(0, None, 2), slice(1, None, 2)]
    integrals = [
        _integral(place[rows][:, part], linear[:, part], light[rows][:, part], middle.light[rows]) for part in parts
    ]
    (whole, residual), *halves = np.array(integrals) / (4 * math.pi**2 * ball.size**2)
    flux[rows] = whole
    ray_error = np.maximum(middle.relative_error, passes.relative_error.reshape(n, -1).max(axis=1))[rows]
    error[rows] = np.abs(np.array(halves)[:, 0] - whole).max(axis=0) + residual + ray_error * whole
    return flux, error, smooth


def _is_smooth(middle: Passes, passes: Passes) -> Bool[Array, " n"]:
    """True for images whose light hardly differs between the middle and the limb."""
    with np.errstate(invalid="ignore", divide="ignore"):
        here = (middle.light / np.linalg.det(middle.by_sky))[:, None]
        limb = (passes.light / np.linalg.det(passes.by_sky)).reshape(len(here), -1)
        ratio = np.concatenate([limb / here, np.ones_like(here)], axis=1)
        return (ratio > 0).all(axis=1) & (ratio.max(axis=1) < _SMOOTH * ratio.min(axis=1))


def _from_middle(middle: Passes, passes: Passes, aim: Float[Array, "rays 2"]) -> Float[Array, "n rays_each 2"]:
    """Lambert's coordinates of rays about those past the middle, along `tangent_basis`; the last step added."""
    left = aim - passes.place - passes.by_time * passes.time_deficit[:, None]
    sky = along_sky(passes.sky, np.nan_to_num(solutions(passes.by_sky, left))).reshape(len(middle), -1, 3)
    scale = np.sqrt(2 / (1 + (sky * middle.sky[:, None]).sum(axis=2)))
    return np.stack([(sky * e[:, None]).sum(axis=2) * scale for e in tangent_basis(middle.sky)], axis=-1)


def _integral(
    place: Float[Array, "n rays 2"],
    linear: Float[Array, "n rays 2"],
    light: Float[Array, "n rays"],
    middle: Float[Array, " n"],
) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """The integral of light within curves round the origin, from places on them at equal steps of a parameter.

    And its error if light has terms of the third degree as large as the residual of the polynomial on the curve: they
    are odd, so that they contribute only in proportion to the variation of the integrand along the curve.

    linear: the places in coordinates in which the curves are nearly circles of radius 1; middle: the light in the
    origin. At the part s of the distance from it light is c + s a + s^2 b, with the mean c + 2 a / 3 + b / 2 over s ds.
    """
    count = light.shape[1]
    wave = np.fft.fftfreq(count, 1 / count)
    # The highest wave of an even number of places has no slope at them.
    wave[2 * np.abs(wave) == count] = 0.0
    curve = place[..., 0] + 1j * place[..., 1]
    twice_area = (curve.conj() * np.fft.ifft(1j * wave * np.fft.fft(curve))).imag
    x, y = linear[..., 0], linear[..., 1]
    terms = np.stack([x, y, x * x, x * y, y * y], axis=-1)
    change = light - middle[:, None]
    factor = (np.linalg.pinv(terms) @ change[..., None])[..., 0]
    missed = np.abs((terms @ factor[..., None])[..., 0] - change).max(axis=1)
    weighed = factor * np.array([2 / 3, 2 / 3, 0.5, 0.5, 0.5])
    mean = middle[:, None] + (terms @ weighed[..., None])[..., 0]
    # Parts of a bent image that are swept twice count once: both signs occur.
    summed = twice_area * mean
    return np.abs(summed.mean(axis=1)) * np.pi, np.ptp(summed, axis=1) / mean.mean(axis=1) * missed * np.pi
