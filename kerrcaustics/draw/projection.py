"""From directions on the camera sky to the plane of a picture."""

import math

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.spatial import KDTree

from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.spacetime.shadow import shadow_axes, straight_out, upright_axes
from kerrcaustics.spacetime.sphere import angle_between
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Degrees of position angle that the unrolled camera sky shows at both of its ends.
OVERLAP = 14
# Nearer to the shadow edge than this (degrees), round-off of the camera-sky direction is all there is.
_ROUND_OFF = 5e-14
TURNS = (-360, 0, 360)
"""Degrees by which a line is moved to be seen throughout: the unrolled camera sky shows a little more than a turn."""

# Rows: forward to the hole, right, up, for a camera that is at rest or moves along e_phi.
_TO_THE_HOLE = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
# Curves of so many points are smoothed: fewer are drawn as they are, more need it not.
_FEWEST_SMOOTHED, _MOST_SMOOTHED = 32, 1000


def view_axes(caustics: CausticSet, edge: Float[Array, "n 3"]) -> Float[Array, "3 3"]:
    """Forward, right and up (3, 3), rows in camera-sky components: forward to the centre of the shadow.

    The centre is the direction of the vector area of the edge. Where that lies outside one of the curves (close to the
    horizon, where the shadow is nearly the whole sky) it is the direction of light that comes straight out of the hole,
    which every critical curve encloses.
    """
    return axes_about(caustics.camera, edge, [caustic.sky for caustic in caustics])


def axes_about(camera: Viewer, edge: Float[Array, "n 3"], curves: list[Array]) -> Float[Array, "3 3"]:
    """The same about any curves (n, 3) on the camera sky that enclose the hole."""
    axes = shadow_axes(camera, edge)
    if all(_encloses_centre(curve, axes) for curve in (edge, *curves)):
        return axes
    return upright_axes(camera, straight_out(camera))


def _encloses_centre(curve: Float[Array, "n 3"], axes: Float[Array, "3 3"]) -> bool:
    """True when a closed curve (n, 3) runs once round the forward axis."""
    angle = position_angle(np.concatenate([curve, curve[:1]]), axes)
    return bool(abs(np.unwrap(angle, period=360)[-1] - angle[0]) > 180)


def whole_line(points: Float[Array, "n k"], closed: bool) -> Float[Array, "m k"]:
    """A curve whose first point is repeated where it is closed."""
    return np.concatenate([points, points[:1]]) if closed else points


def smoothed(directions: Float[Array, "n k"]) -> Float[Array, "m k"]:
    """A closed curve (n, 3) with ten points for one: the projection stretches its steps where it runs far back.

    One of places (alpha, beta) too.
    """
    closed = np.concatenate([directions, directions[:1]])
    if not _FEWEST_SMOOTHED <= len(directions) <= _MOST_SMOOTHED:
        return directions
    curve = CubicSpline(np.arange(len(closed)), closed, bc_type="periodic")
    dense = curve(np.linspace(0, len(directions), 10 * len(directions), endpoint=False))
    return dense / np.linalg.norm(dense, axis=1, keepdims=True) if dense.shape[1] == 3 else dense


def azimuthal_equidistant(directions: Float[Array, "*batch 3"], axes: Float[Array, "3 3"]) -> Float[Array, "*batch 2"]:
    """Plane coordinates (..., 2), right and up in degrees, of directions (..., 3)."""
    along, right, up = np.moveaxis(directions @ axes.T, -1, 0)
    across = np.hypot(right, up)
    scale = np.degrees(np.arctan2(across, along)) / np.where(across > 0, across, 1.0)
    return np.stack([right * scale, up * scale], axis=-1)


def about_hole(sky: Float[Array, "*batch k"]) -> Float[Array, "*batch 2"]:
    """Degrees to the right and up from the hole of directions (..., 3); places (alpha, beta) as they are."""
    return sky if sky.shape[-1] == 2 else azimuthal_equidistant(sky, _TO_THE_HOLE)


def position_angle(directions: Float[Array, "*batch 3"], axes: Float[Array, "3 3"]) -> Float[Array, "*batch"]:
    """Angle (...,) in [0, 360) degrees about the forward axis, from right over up."""
    right, up = np.moveaxis(directions @ axes[1:].T, -1, 0)
    return np.asarray(np.degrees(np.arctan2(up, right)) % 360)


def distance_to_edge(directions: Float[Array, "n 3"], edge: Float[Array, "m 3"]) -> Float[Array, " n"]:
    """Angle (n,) in degrees from directions (n, 3) to the nearest point of the edge; NaN below round-off."""
    closed = np.concatenate([edge, edge[:1]])
    # Arc length, rather than the number of the point: points displaced along the edge then do no harm.
    arc = np.concatenate([[0.0], np.cumsum(angle_between(closed[1:], closed[:-1]))])
    curve = make_interp_spline(arc, closed, k=5, bc_type="periodic")
    velocity, acceleration = curve.derivative(1), curve.derivative(2)
    place = arc[KDTree(edge).query(directions)[1]]
    longest = np.diff(arc).max()
    for _ in range(5):
        gap, speed = curve(place) - directions, velocity(place)
        slope = (speed**2).sum(-1) + (gap * acceleration(place)).sum(-1)
        step = (gap * speed).sum(-1) / np.where(slope > 0.1, slope, 1.0)
        place = (place - np.clip(step, -longest, longest)) % arc[-1]
    distance = np.degrees(angle_between(curve(place), directions))
    return np.where(distance > _ROUND_OFF, distance, np.nan)


def unrolled_places(
    sky: Float[Array, "n 3"], axes: Float[Array, "3 3"], edge: Float[Array, "m 3"]
) -> Float[Array, "n 2"]:
    """Position angle and distance to the shadow edge (n, 2) of directions (n, 3), in degrees."""
    return np.stack([position_angle(sky, axes), distance_to_edge(sky, edge)], axis=-1)


def unrolled_curve(
    sky: Float[Array, "n 3"], axes: Float[Array, "3 3"], edge: Float[Array, "m 3"], closed: bool
) -> Float[Array, "k 2"]:
    """Line of a curve of directions (n, 3) on the unrolled camera sky."""
    angle, distance = unrolled_places(sky, axes, edge).T
    return unrolled(angle, distance, closed)


def unrolled(angle: Float[Array, " n"], distance: Float[Array, " n"], closed: bool) -> Float[Array, "m 2"]:
    """Line (m, 2) of a curve round the shadow; a closed one runs through the whole of 0 to 360 degrees.

    One that does not go round the shadow is there three times, a turn apart.
    """
    if not closed:
        jump = np.flatnonzero(np.abs(np.diff(angle)) > 180) + 1
        return np.insert(np.stack([angle, distance], axis=-1), jump, np.nan, axis=0)
    smooth = np.unwrap(np.append(angle, angle[0]), period=360)
    circuit = 360 * round((smooth[-1] - smooth[0]) / 360)
    if circuit == 0:
        # Beside the centre rather than round it: the whole curve, at every turn at which it is seen.
        whole = np.append(distance, distance[0])
        return np.concatenate([[*zip(smooth + turn, whole, strict=True), (math.nan, math.nan)] for turn in TURNS])
    thrice = np.concatenate([smooth[:-1] + turn * circuit for turn in (-1, 0, 1)])
    visible = np.flatnonzero(np.abs(thrice - 180) < 185 + OVERLAP)
    part = slice(visible[0], visible[-1] + 1)
    return np.stack([thrice[part], np.tile(distance, 3)[part]], axis=-1)
