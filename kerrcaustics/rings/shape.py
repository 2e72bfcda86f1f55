"""Shapes of closed curves on a sky: areas, centroids, projected widths, and the fit of a circlipse.

The projected width of a ring at an angle is what the visibility on a baseline at that angle shows: its period along the
baseline.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.lens_map.search_sky import ScreenSky, SearchSky, search_sky
from kerrcaustics.numerics import fourier
from kerrcaustics.rings.band_edge import Arc, BandEdge, arcs, distances_on, has_point, lines_of, turns
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import numbers
from kerrcaustics.spacetime.observer import SCREEN

Array = np.ndarray

# Gauss-Legendre nodes from the inner to the outer edge of a band.
_ON_CHORD = 40
# Rounding of an area, relative.
_OF_AREA = 4e-15
# Nodes of a curve among which its extremes are searched for, by those of the edge.
_FINER = 4
# Steps of Newton's method to an extreme.
_REFINEMENTS = 4
# Trial values of the angle of a circlipse, and steps of Gauss and Newton from the best.
_TRIALS, _STEPS = 16, 30


class Area(NamedTuple):
    """An area on a sky, and its error, in the square of the sky's unit."""

    size: float
    error: float


class Circlipse(NamedTuple):
    """The fit of a circlipse to projected diameters d of a curve, Gralla & Lupsasca 2020.

    d / 2 = circle + sqrt(ellipse_1^2 sin^2(phi - angle) + ellipse_2^2 cos^2(phi - angle)).

    circle: radius of the circle, M.
    ellipse_1: half axis of the ellipse across the angle, M.
    ellipse_2: half axis of the ellipse along the angle, M.
    angle: its angle on the screen, from alpha toward beta, radians.
    residual: root of the mean square of the differences, relative to the mean diameter.
    """

    circle: float
    ellipse_1: float
    ellipse_2: float
    angle: float
    residual: float


class _Chords(NamedTuple):
    """Lines from the inner to the outer edge of a band, at even steps of chi.

    inner: angle from the middle of the hole to the inner edge, on the sky that is searched, radians.
    outer: the same of the outer edge.
    gap: their difference, without the cancellation.
    turn: position angle about the middle of the hole.
    step: its change from one line to the next.
    """

    inner: Float[Array, " lines"]
    outer: Float[Array, " lines"]
    gap: Float[Array, " lines"]
    turn: Float[Array, " lines"]
    step: Float[Array, " lines"]


def _chords(inner: BandEdge, outer: BandEdge, count: int) -> _Chords:
    lines = lines_of(inner, count)
    near, far = distances_on(inner, lines), distances_on(outer, lines)
    return _Chords(near - lines.first, far - lines.first, far - near, *turns(lines))


def area_between(inner: BandEdge, outer: BandEdge) -> Area:
    """The area between the edges of a band, with an error by those of the points and by half as many nodes."""
    nodes = len(inner.distance)
    size, coarse = (_area(inner, outer, _chords(inner, outer, count)) for count in (2 * nodes, nodes))
    lengths = (np.linalg.norm(np.diff(edge.sky, axis=0, append=edge.sky[:1]), axis=1) for edge in (inner, outer))
    across = sum(float(edge.error @ length) for edge, length in zip((inner, outer), lengths, strict=True))
    return Area(size, across + abs(size - coarse) + _OF_AREA * size)


def _area(inner: BandEdge, outer: BandEdge, chords: _Chords) -> float:
    """Sum over chords: in closed form for viewers at rest, by Gauss-Legendre nodes with aberration."""
    sky = search_sky(inner.camera)
    if isinstance(sky, ScreenSky):
        half = np.cos(chords.inner / 2) * np.cos(chords.outer / 2)
        both = np.tan(chords.inner / 2) + np.tan(chords.outer / 2)
        across = 2 * SCREEN**2 * np.sin(chords.gap / 2) / half * both
    elif sky.shares_engines and not inner.camera.frame().speed:
        across = 2 * np.sin(chords.gap / 2) * np.sin((chords.inner + chords.outer) / 2)
    else:
        _, weight = _places_between(sky, chords)
        return float(weight.sum())
    return float(across @ chords.step)


def _places_between(sky: SearchSky, chords: _Chords) -> tuple[Float[Array, "nodes axes"], Float[Array, " nodes"]]:
    """Places on the viewer's sky between the edges, and the areas for which they stand."""
    place, weight = np.polynomial.legendre.leggauss(_ON_CHORD)
    part = chords.gap[:, None] / 2
    angle = chords.inner[:, None] + part * (1 + place)
    turn = chords.turn[:, None]
    around = -np.cos(angle), np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn)
    directions = np.stack(around, axis=-1).reshape(-1, 3)
    area = np.sin(angle) * part * weight * chords.step[:, None]
    return sky.to_viewer(directions), area.ravel() * sky.lengths(directions) ** 2


def centroid_of(inner: BandEdge, outer: BandEdge) -> Float[Array, " axes"]:
    """Centroid of a uniform band: (alpha, beta), or the direction N of the sum of its directions."""
    place, weight = _places_between(search_sky(inner.camera), _chords(inner, outer, 2 * len(inner.distance)))
    total = weight @ place
    return total / weight.sum() if place.shape[1] == 2 else total / np.linalg.norm(total)


def support(edge: BandEdge, angle: Float[Array, " angles"]) -> Float[Array, " angles"]:
    """The largest projection of a curve on a screen onto directions at angles from alpha toward beta, M."""
    onto = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    best = np.full(len(angle), -np.inf)
    for arc in arcs(edge, _FINER * len(edge.distance)):
        best = np.maximum(best, _largest_on(arc, onto))
    if has_point(edge):
        # The lower half is the middle of the hole.
        best = np.maximum(best, 0.0)
    return best


def _largest_on(arc: Arc, onto: Float[Array, "angles 2"]) -> Float[Array, " angles"]:
    """The largest projections on a part of a curve: among nodes, then by Newton's method on its Fourier series."""
    count = 2 * (len(arc.series) - 1)
    chi = fourier.nodes(count)
    within = np.append(chi[(chi > arc.first) & (chi < arc.last)], [arc.first, arc.last])
    values = fourier.values_at(arc.series, within) @ onto.T
    place = within[np.argmax(values, axis=0)]
    for _ in range(_REFINEMENTS):
        slope, bend = (np.einsum("ij,ij->i", fourier.values_at(arc.series, place, k), onto) for k in (1, 2))
        step = np.where(bend < 0, -slope / np.where(bend < 0, bend, 1), 0)
        place = place + np.clip(step, -2 * np.pi / count, 2 * np.pi / count)
        if arc.last - arc.first < 6:
            # A half ends there; a whole curve goes on.
            place = np.clip(place, arc.first, arc.last)
    return np.maximum(values.max(axis=0), np.einsum("ij,ij->i", fourier.values_at(arc.series, place), onto))


def circlipse(diameter: ArrayLike, angle: ArrayLike) -> Circlipse:
    """The circlipse that fits projected diameters best.

    Parameters
    ----------
    diameter : (n,) array
        Projected diameters, as `PhotonRings.diameter` gives them, M.
    angle : (n,) array
        Their angles on the screen, radians; at least 4 over half a turn.

    Returns
    -------
    Circlipse

    Raises
    ------
    ValueError
        If there are fewer than 4 diameters, or not as many as angles.

    References
    ----------
    Gralla & Lupsasca 2020, arXiv:2007.10336.

    Examples
    --------
    >>> import numpy as np, kerrcaustics as kc
    >>> from kerrcaustics.rings.shape import circlipse
    >>> rings, angle = kc.photon_rings(kc.Observer(spin=0.94, inclination=0.3)), np.linspace(0, np.pi, 60)
    >>> circlipse(rings.diameter(angle).edge, angle).residual < 1e-5
    True
    """
    d, phi = numbers("diameter", diameter), numbers("angle", angle)
    if d.ndim != 1 or d.shape != phi.shape or len(d) < 4:
        raise ValueError("Argument `diameter` must hold at least 4 numbers, as many as `angle`.")
    trials = [_fitted(d / 2, phi, start) for start in np.arange(_TRIALS) * math.pi / _TRIALS]
    values = min(trials, key=lambda fit: float(np.sum((_circlipse_radius(fit, phi) - d / 2) ** 2)))
    residual = np.sqrt(np.mean((_circlipse_radius(values, phi) - d / 2) ** 2)) / (d / 2).mean()
    circle, first, second, turn = (float(value) for value in values)
    return Circlipse(circle, abs(first), abs(second), turn % math.pi, float(residual))


def _circlipse_radius(values: Float[Array, " 4"], phi: Array) -> Array:
    circle, first, second, turn = values
    return circle + np.hypot(first * np.sin(phi - turn), second * np.cos(phi - turn))


def _fitted(half: Array, phi: Array, turn: float) -> Float[Array, " 4"]:
    """Parameters of a circlipse by Levenberg's method, from an angle."""
    values = np.array([half.mean() / 2, half.mean() / 2 * 1.01, half.mean() / 2 * 0.99, turn])
    damping, misfit = 1e-3, _circlipse_radius(values, phi) - half
    for _ in range(_STEPS):
        step = 1e-7
        jacobian = np.stack(
            [(_circlipse_radius(values + step * unit, phi) - half - misfit) / step for unit in np.eye(4)], axis=-1
        )
        normal = jacobian.T @ jacobian
        move = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), -jacobian.T @ misfit)
        trial = _circlipse_radius(values + move, phi) - half
        better = trial @ trial < misfit @ misfit
        values, misfit = (values + move, trial) if better else (values, misfit)
        damping = damping / 5 if better else damping * 5
    return values
