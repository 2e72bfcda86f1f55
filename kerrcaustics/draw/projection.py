"""Projection of directions on the camera sky onto the plane of a picture.

All pictures of it have one zero, the middle of the shadow: degrees to the right of it and above it, in the azimuthal
equidistant projection, up being the spin axis. The sky of an Observer is flat, and is drawn as it is: (alpha, beta) in
M, which are zero where light comes straight out of the hole.
"""

import math

import numpy as np

from kerrcaustics.numerics.splines import Spline
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge
from kerrcaustics.spacetime.sphere import angle_between
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Degrees of position angle that the unrolled camera sky shows at both of its ends.
OVERLAP = 14
# Nearer to the shadow edge than this (degrees), round-off of the camera-sky direction is all there is.
_ROUND_OFF = 5e-14
TURNS = (-360, 0, 360)
"""Degrees by which a line is moved to be seen throughout: the unrolled camera sky shows a little more than a turn."""

# Degrees on a picture of the camera sky; a longer step runs round the back of it.
_LONGEST = 90.0
# Points of the shadow edge, for its middle to a ten-thousandth of a degree.
_EDGE_POINTS = 720
# Curves of so many points are smoothed: fewer are drawn as they are, more need it not.
_FEWEST_SMOOTHED, _MOST_SMOOTHED = 32, 1000


def view_axes(camera: Viewer, edge: Float[Array, "n axes"]) -> Float[Array, "..."]:
    """Forward, right and up (3, 3), rows in camera-sky components: forward to the middle of the shadow.

    Of an Observer the middle (2,) itself, about which position angles are measured.
    """
    return _middle(edge) if _is_flat(edge) else shadow_axes(camera, edge)


def _is_flat(sky: Float[Array, "*batch axes"]) -> bool:
    """True for places (alpha, beta)."""
    return sky.shape[-1] == 2


def _middle(curve: Float[Array, "n 2"]) -> Float[Array, "2"]:
    """The centre of the area within a closed curve."""
    following = np.roll(curve, -1, axis=0)
    area = curve[:, 0] * following[:, 1] - curve[:, 1] * following[:, 0]
    return (curve + following).T @ area / (3 * area.sum())


def whole_line(points: Float[Array, "n k"], closed: bool) -> Float[Array, "m k"]:
    """A curve whose first point is repeated where it is closed."""
    return np.concatenate([points, points[:1]]) if closed else points


def smoothed(directions: Float[Array, "n axes"]) -> Float[Array, "m axes"]:
    """A closed curve (n, axes) with ten points for one: the projection stretches its steps where it runs far back."""
    closed = np.concatenate([directions, directions[:1]])
    if not _FEWEST_SMOOTHED <= len(directions) <= _MOST_SMOOTHED:
        return directions
    curve = Spline(np.arange(float(len(closed))), closed, periodic=True)
    dense = curve(np.linspace(0, len(directions), 10 * len(directions), endpoint=False))
    return dense if _is_flat(dense) else dense / np.linalg.norm(dense, axis=1, keepdims=True)


def azimuthal_equidistant(
    directions: Float[Array, "*batch axes"], axes: Float[Array, "..."]
) -> Float[Array, "*batch 2"]:
    """Plane coordinates (..., 2), right and up in degrees, of directions (..., 3); places (alpha, beta) as they are."""
    if _is_flat(directions):
        return directions
    along, right, up = np.moveaxis(directions @ axes.T, -1, 0)
    across = np.hypot(right, up)
    scale = np.degrees(np.arctan2(across, along)) / np.where(across > 0, across, 1.0)
    return np.stack([right * scale, up * scale], axis=-1)


def about_shadow(camera: Viewer, sky: Float[Array, "*batch k"]) -> Float[Array, "*batch 2"]:
    """Degrees to the right of the shadow's middle and above it of directions; places (alpha, beta) as they are."""
    return azimuthal_equidistant(sky, view_axes(camera, shadow_edge(camera, _EDGE_POINTS)))


def broken(line: Float[Array, "n 2"]) -> Float[Array, "m 2"]:
    """A line on a picture of the camera sky, degrees, with gaps where it runs round the back of it."""
    far = np.flatnonzero(np.hypot(*np.diff(line, axis=0).T) > _LONGEST) + 1
    return np.insert(line, far, np.nan, axis=0)


def position_angle(directions: Float[Array, "*batch axes"], axes: Float[Array, "..."]) -> Float[Array, "*batch"]:
    """Angle (...,) in [0, 360) degrees about the forward axis, from right over up."""
    across = directions - axes if _is_flat(directions) else directions @ axes[1:].T
    right, up = np.moveaxis(across, -1, 0)
    return np.asarray(np.degrees(np.arctan2(up, right)) % 360)


def distance_to_edge(directions: Float[Array, "n axes"], edge: Float[Array, "m axes"]) -> Float[Array, " n"]:
    """Distance (n,), in degrees or M, from directions (n, axes) to the edge's nearest point; NaN below round-off."""
    from scipy.interpolate import make_interp_spline
    from scipy.spatial import KDTree

    closed = np.concatenate([edge, edge[:1]])
    # Arc length, rather than the number of the point: points displaced along the edge then do no harm.
    arc = np.concatenate([[0.0], np.cumsum(_distances(closed[1:], closed[:-1]))])
    curve = make_interp_spline(arc, closed, k=5, bc_type="periodic")
    velocity, acceleration = curve.derivative(1), curve.derivative(2)
    place = arc[KDTree(edge).query(directions)[1]]
    longest = np.diff(arc).max()
    for _ in range(5):
        gap, speed = curve(place) - directions, velocity(place)
        slope = (speed**2).sum(-1) + (gap * acceleration(place)).sum(-1)
        step = (gap * speed).sum(-1) / np.where(slope > 0.1, slope, 1.0)
        place = (place - np.clip(step, -longest, longest)) % arc[-1]
    distance = _distances(curve(place), directions) * (1 if _is_flat(edge) else 180 / math.pi)
    return np.where(distance > _ROUND_OFF, distance, np.nan)


def _distances(first: Float[Array, "n axes"], second: Float[Array, "n axes"]) -> Float[Array, " n"]:
    """Angles between directions, radians; distances of places (alpha, beta)."""
    return np.linalg.norm(first - second, axis=-1) if _is_flat(first) else angle_between(first, second)


def unrolled_places(
    sky: Float[Array, "n axes"], axes: Float[Array, "..."], edge: Float[Array, "m axes"]
) -> Float[Array, "n 2"]:
    """Position angle and distance to the shadow edge (n, 2) of directions (n, axes), in degrees, or M."""
    return np.stack([position_angle(sky, axes), distance_to_edge(sky, edge)], axis=-1)


def unrolled_curve(
    sky: Float[Array, "n axes"], axes: Float[Array, "..."], edge: Float[Array, "m axes"], closed: bool
) -> Float[Array, "k 2"]:
    """Line of a curve of directions (n, axes) on the unrolled camera sky."""
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
