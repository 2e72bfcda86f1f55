"""The edge of the shadow: the directions whose rays wind for ever onto a spherical photon orbit."""

import math
from functools import lru_cache
from typing import Any

import numpy as np

from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import whole_number
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.sphere import lengths, unit
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

_MOST_POINTS = 1_000_000
# Steps of the table of edge phases.
_TABLE = 1024
# Longest step of a resolved table, over the mean one.
_LONGEST = 1.5
# Rounds after which the table is taken as it is.
_ROUNDS = 30


@usual_warnings
def shadow_edge(camera: Viewer, n: int = 360) -> np.ndarray:
    """Directions N (n, 3) on the camera sky of n points of the shadow edge, a closed curve; of an Observer (n, 2).

    The curve runs clockwise as seen looking at the hole with the spin axis up, from its prograde end on the left;
    the last point is not the first one repeated. No step between neighbours is longer on the camera sky than about
    twice the mean one.

    Parameters
    ----------
    camera : Camera or Observer
    n : int
        Number of points.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    About 1e-15 rad, from closed formulas (JTFT A.1).

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> kc.shadow_edge(camera, 100).shape
    (100, 3)
    """
    check_viewer(camera)
    n = whole_number("n", n, 1, _MOST_POINTS)
    return _edge_places(camera, even_phases(camera, np.arange(n) / n))


def shadow_axes(camera: Viewer, edge: np.ndarray) -> np.ndarray:
    """Forward to the middle of the shadow, right and up; rows (3, 3), components on the camera sky.

    Parameters: edge (n, 3), as `shadow_edge` gives it, with the shadow on the right of its way; the middle is the
    direction of its vector area: the mean of all directions in the shadow, be that more than half of the sky.
    """
    area = np.cross(edge, np.roll(edge, -1, axis=0)).sum(axis=0)
    forward = area / np.linalg.norm(area)
    e_theta = np.asarray(camera.frame().basis)[:, 1]
    up = -e_theta + (e_theta @ forward) * forward
    up /= np.linalg.norm(up)
    return np.stack([forward, np.cross(forward, up), up])


def even_phases(viewer: Viewer, part: np.ndarray) -> np.ndarray:
    """Edge phases (...,) at parts of the way round the shadow edge, evenly both on the viewer's sky and in edge phase.

    Parameters: part (...,) in [0, 1], counted from the prograde end. The way is the mean of the part of the length on
    the sky and of the part of a turn of edge phase. On the straight side of a fast hole's edge the edge phase hardly
    changes, and equal steps in it alone pass over that side; next to such a hole the rest of the edge hardly moves.
    """
    return np.interp(part, *_ways_and_phases(viewer))


@lru_cache(maxsize=64)
def _ways_and_phases(viewer: Viewer) -> tuple[np.ndarray, np.ndarray]:
    """Parts of the way before edge phases over one turn, which are so close that neither makes a jump."""
    edge_phase = np.linspace(0, 2 * math.pi, _TABLE + 1)
    steps = _steps(viewer, edge_phase)
    for _ in range(_ROUNDS):
        if steps.max() <= _LONGEST * steps.mean():
            break
        edge_phase = np.interp(np.linspace(0, 1, _TABLE + 1), _sums(steps), edge_phase)
        steps = _steps(viewer, edge_phase)
    return _sums(steps), edge_phase


def _steps(viewer: Viewer, edge_phase: np.ndarray) -> np.ndarray:
    """The ways between edge phases, in units of half the way round."""
    size = lengths(np.diff(_edge_places(viewer, edge_phase), axis=0))
    # An edge smaller than round-off has no length.
    return size / max(size.sum(), 1e-300) + np.diff(edge_phase) / (2 * math.pi)


def _sums(steps: np.ndarray) -> np.ndarray:
    """Parts of the sum of all steps before and after each."""
    sums = np.append(0.0, np.cumsum(steps))
    return sums / sums[-1]


def _edge_places(viewer: Viewer, edge_phase: np.ndarray) -> np.ndarray:
    """Places of the shadow edge on the viewer's sky: N (..., 3), or (alpha, beta) (..., 2)."""
    return viewer.places(sky_from_fido(viewer.frame(), edge_photons(viewer, edge_phase)))


def edge_photons(camera: Viewer, edge_phase: np.ndarray) -> np.ndarray:
    """Directions of motion (n_r, n_theta, n_phi) (..., 3), in the FIDO frame, of photons on the shadow edge.

    Parameters: edge_phase (...,), the parameter of the curve, period 2 pi: 0 is the prograde end, pi the retrograde
    end, and the photon moves toward larger theta for 0 < edge_phase < pi.

    The curve is followed by the local azimuthal momentum l = p_phi / (rho-free scale) = middle + half
    cos(edge_phase), from which the spherical photon orbit and p_theta follow; smooth for every spin, zero included,
    and for every inclination, the axis included.
    """
    frame = camera.frame()
    a, s, c, r = frame.spin, frame.sin_theta, frame.cos_theta, frame.radius
    low, high = _momentum_range(camera)
    edge_phase = np.asarray(edge_phase, float)
    momentum = (high + low) / 2 + (high - low) / 2 * np.cos(edge_phase)
    b = momentum * s
    orbit, q = kerr.spherical_orbit_of_impact(a, b)
    p_theta = np.sqrt(np.maximum(_theta_potential(q, momentum, a, c), 0)) * np.sign(np.sin(edge_phase))
    # R = (r - r_o)^2 (r^2 + 2 r_o r - a^2 q / r_o^2): its root changes sign with the side of the orbit.
    root_potential = (r - orbit) * np.sqrt(r**2 + 2 * orbit * r - a**2 * q / orbit**2)
    at = kerr.metric(a, r, c)
    # Light from an orbit below the camera moves outward there, light from one above it moves inward.
    n_r = root_potential / math.sqrt(at.sigma * at.delta)
    n_theta = p_theta / (math.sqrt(at.sigma) * frame.zoom)
    n_phi = momentum / frame.cylindrical_scale
    if frame.zoom != 1:
        # The inverse of `zoomed`.
        square, across = frame.zoom**2, n_theta**2 + n_phi**2
        size = np.sqrt(n_r**2 + square * across)
        n_r, n_theta, n_phi = n_r / size, n_theta / size, n_phi / size
        half = (1 + n_r) / 2
        n_r, n_theta, n_phi = half**2 - (n_theta**2 + n_phi**2) / 4, n_theta * half, n_phi * half
    return unit(np.stack([n_r, n_theta, n_phi], axis=-1))


def _theta_potential(q: Any, momentum: Any, a: float, c: float) -> Any:
    return q - c**2 * (momentum - a) * (momentum + a)


@lru_cache(maxsize=256)
def _momentum_range(camera: Viewer) -> tuple[float, float]:
    """Least and largest p_phi / sin(theta) on the shadow edge, where p_theta vanishes."""
    a, s, c = camera.spin, camera.sin_theta, camera.cos_theta

    def potential(momentum: np.ndarray) -> np.ndarray:
        return _theta_potential(kerr.spherical_orbit_of_impact(a, momentum * s)[1], momentum, a, c)

    ends = []
    for orbit, limit in zip(kerr.photon_orbits(a), (math.sqrt(27), -math.sqrt(27)), strict=True):
        equatorial = kerr.spherical_orbit_impact(a, orbit) if a > 1e-3 else limit - 2 * a
        if c == 0 and a > 1e-3:
            ends.append(equatorial)
            continue
        far = equatorial / s if abs(equatorial) < 8 * s else math.copysign(8, equatorial)
        # The equatorial end may miss by round-off of keeping the sign; a little further out it cannot.
        for _ in range(60):
            if potential(np.array(far)) < 0:
                break
            far *= 1 + 1e-3
        ends.append(float(bracketed_roots(potential, (np.zeros(1), np.array([far])), absolute=1e-16).x[0]))
    prograde, retrograde = ends
    return retrograde, prograde
