"""Isoradials: where on the camera sky the image of each ring of a disk lies, one place for each ring and turn.

For sums over a disk: a few beams lead to each place, and give the solid angle about it, but the camera must lie off the
plane, and the radius must grow outward from the middle. Whole curves of one ring, wherever the camera is and however
often a line meets them, come from tracks/isoradials.py, which looks along every line first.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from kerrcaustics.beams.beam import Beams, Status
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.sphere import tangent_basis

Array = np.ndarray

_MOST_STEPS = 90
# Error of ln r; the one that is accepted where the angle has no more digits, and the last one of its logarithm.
_CLOSE, _TAKEN, _LAST_DIGIT = 1e-11, 1e-6, 4e-16
# The error of ln r by directions in double precision, for each unit of the camera's radius.
_DOUBT = 4e-16
# The innermost angle, in units of 1 / the camera's radius.
_INNERMOST = 1e-6


class Isoradials(NamedTuple):
    """Places of n rings on the camera sky, each at one turn about the middle of the horizon's image.

    sky (n, 3), directions N; angle (n,), radians from the middle; slope (n,), dr / d angle at this turn; redshift (n,),
    nu_camera / nu_emitter; NaN for no image. rays, the number traced in all.
    """

    sky: Array
    angle: Array
    slope: Array
    redshift: Array
    rays: int


def middle(camera: Camera) -> Float[Array, "3"]:
    """Direction N (3,) of the principal null ray, which falls in at the camera's own inclination: it meets no plane."""
    frame = camera.frame()
    scale, momentum = frame.cylindrical_scale, frame.spin * frame.sin_theta
    along_phi = momentum * frame.lapse / (scale * (1 - frame.shift * frame.sin_theta * momentum))
    return sky_from_fido(frame, np.array([math.sqrt(1 - along_phi**2), 0.0, along_phi]))


class _GreatCircles:
    """Great circles of the camera sky that leave the middle, and the beams along them."""

    def __init__(self, camera: Camera, turn: Float[Array, " n"], end: EquatorialPlane) -> None:
        """From the turns at which they leave it."""
        self._camera, self._end, self._middle = camera, end, middle(camera)
        first, second = tangent_basis(self._middle)
        self._ahead = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second

    def sky(self, which: Array, angle: Array) -> Float[Array, "n 3"]:
        """Directions at angles from the middle, on some of the ways."""
        return np.cos(angle)[:, None] * self._middle + np.sin(angle)[:, None] * self._ahead[which]

    def beams(self, which: Array, angle: Array) -> tuple[Beams, Array]:
        """The beams there, and dr / d angle."""
        sky = self.sky(which, angle)
        beams = trace_beams(self._camera, sky, end=self._end, index=False, crossings=False)
        outward = np.cos(angle)[:, None] * self._ahead[which] - np.sin(angle)[:, None] * self._middle
        first, second = (np.einsum("ij,ij->i", tangent, outward) for tangent in tangent_basis(sky))
        return beams, beams.jacobian[:, 0, 0] * first + beams.jacobian[:, 0, 1] * second


def isoradials(
    camera: Camera, radius: Float[Array, " n"], turn: Float[Array, " n"], crossing: int, motion: str
) -> Isoradials:
    """Images of the crossing of the plane with this number at radii (n,), at turns (n,) about the middle.

    The radius is taken to grow with the angle from the middle. The angle is bracketed by what falls in and what goes
    beyond, and refined by Newton's method with the beam's Jacobian to 1e-11 of ln r, or as far as doubles go.
    """
    circles, log_radius = _GreatCircles(camera, turn, EquatorialPlane(crossing, motion)), np.log(radius)
    low, high = np.full(len(turn), math.log(_INNERMOST / camera.radius)), np.full(len(turn), math.log(math.pi))
    at, results = (low + high) / 2, np.full((3, len(turn)), np.nan)
    left, rays, close = np.arange(len(turn)), 0, max(_CLOSE, _DOUBT * camera.radius)
    for step in range(_MOST_STEPS):
        angle = np.exp(at[left])
        beams, slope = circles.beams(left, angle)
        rays += len(left)
        beyond = _beyond(beams, log_radius[left])
        low[left], high[left] = np.where(beyond < 0, at[left], low[left]), np.where(beyond < 0, high[left], at[left])
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = at[left] - beyond * beams.radius / (slope * angle)
        closed = high[left] - low[left] <= _LAST_DIGIT * np.abs(at[left])
        done = np.abs(beyond) < np.where(closed, _TAKEN, close)
        for row, new in zip(results, (angle, slope, beams.redshift), strict=True):
            row[left[done]] = np.asarray(new)[done]
        # Now and then the bracket is halved: Newton's steps may creep.
        inside = (newton > low[left]) & (newton < high[left]) & (step % 4 != 3)
        at[left] = np.where(inside, newton, (low[left] + high[left]) / 2)
        left = left[~done & ~closed]
        if not len(left):
            break
    angle, slope, redshift = results
    return Isoradials(circles.sky(np.arange(len(turn)), angle), angle, slope, redshift, rays)


def _beyond(beams: Beams, log_radius: Array) -> Array:
    """Distance in ln r beyond a radius at which rays cross the plane; -1 if they are captured, 1 if they escape."""
    assert beams.radius is not None
    without = np.where(beams.status == Status.CAPTURED, -1.0, 1.0)
    return np.where(np.isfinite(beams.radius), np.log(beams.radius) - log_radius, without)
