"""Weighted areas within arcs on a viewer's sky, by Green's theorem, component by component.

Each connected boundary has a separate origin, so that small images keep their digits: in Lambert's equal-area plane
about it the area is half the integral of x dy - y dx along the boundary. A screen is such a plane itself.

On a sphere a closed curve has two sides. The measured side excludes the direction opposite to the hole. So the area of
boundaries that run round the hole clockwise once more than anticlockwise lacks the whole sky, which `boundaries` adds;
boundaries that run so anticlockwise enclose the direction to the hole, as those of a sphere in front of it do.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from kerrcaustics.extended_sources.arcs.boundary_arcs import (
    AT_ENDS,
    DERIVATIVE,
    NODES,
    WEIGHTS,
    BoundaryArcs,
    at_nodes,
    with_ends,
)
from kerrcaustics.lens_map.search_sky import SearchSky
from kerrcaustics.numerics.matching import component_of
from kerrcaustics.shapes import Complex, Float, Int
from kerrcaustics.spacetime.sphere import from_angles, lengths, tangent_basis, unit

Array = np.ndarray

# Cosine of the largest angle of a boundary from its own origin.
_LEAST_COSINE = 0.3
# Largest angle of an undivided step along a boundary as seen from a place, radians.
_SMALL_ANGLE = 0.5
# Rounds of halving such steps.
_MOST_HALVINGS = 40
# Most steps in a round: more show that an arc passes through a place.
_MOST_STEPS = 4_000_000
# Places of the points of an arc and of both of its ends, in [-1, 1].
_ENDED = np.concatenate([[-1.0], NODES, [1.0]])
_GAUSS, _GAUSS_WEIGHTS = legendre.leggauss(8)
# Radial nodes, as parts of the distance from an origin, and their shares of the area.
_PARTS, _SHARES = (1 + _GAUSS) / 2, _GAUSS_WEIGHTS * (1 + _GAUSS) / 2
# Nodes in the cosine of the sum over the whole sky.
_SKY_NODES = 48
# Widest gap between arcs that meet, in lengths of either.
_WIDEST_GAP = 0.1
_VALUES = legendre.legvander(_ENDED, len(NODES) + 1)


Weight = Callable[[Array], Array]
"""Brightness at places (..., axes) on the viewer's sky."""


@dataclass(frozen=True)
class Boundary:
    """A connected boundary.

    arcs: Numbers of its arcs.
    points: Places of the nodes of each arc and of both its ends.
    integrals: Integrals over the area of the weight, and of the weight times the place; negative for inner edges.
    error: Error of the first integral.
    turns: Turns about the hole, with the image to the left.
    """

    arcs: Int[Array, " arcs"]
    points: Float[Array, "arcs nodes axes"]
    integrals: Float[Array, " columns"]
    error: float
    turns: int

    @property
    def area(self) -> float:
        """The weighted area."""
        return float(self.integrals[0])


def components(arcs: BoundaryArcs) -> list[Int[Array, " _"]]:
    """Numbers of the arcs of each connected boundary."""
    nodes = int(max(arcs.left.max(), arcs.right.max())) + 1
    label = component_of(arcs.left, arcs.right, nodes)[arcs.left]
    return [np.flatnonzero(label == one) for one in np.unique(label)]


def boundaries(
    arcs: BoundaryArcs,
    points: Float[Array, "arcs nodes axes"],
    error: Float[Array, " arcs"],
    sign: Float[Array, " arcs"],
    hole: Float[Array, " axes"],
    weight: Weight | None = None,
) -> list[Boundary]:
    """The boundaries that arcs form.

    Parameters
    ----------
    arcs : BoundaryArcs
        The numbers of their nodes say which of them are connected.
    points : (arcs, nodes, axes) array
        Places of their nodes between both ends.
    error : (arcs,) array
        Error of the area beside each, in the units of the points.
    sign : (arcs,) array
        1 where the image lies to the left of an arc, -1 where to the right.
    hole : (axes,) array
        The direction to the hole.
    weight : function, optional
        Weight of the area; 1 if omitted.
    """
    brightest = 1.0 if weight is None else weight(points).max(axis=1)
    parts = components(arcs)
    loops = [_BoundaryIntegral(points[chosen], sign[chosen], hole) for chosen in parts]
    # Where boundaries turn about the hole backward in all, the images lie round the direction opposite to it.
    missing = -min(0, sum(bound.turns for bound in loops)) if len(hole) == 3 else 0
    bounds = []
    for chosen, bound in zip(parts, loops, strict=True):
        skies = min(missing, max(0, -bound.turns))
        missing -= skies
        off = float((error * brightest)[chosen].sum())
        bounds.append(Boundary(chosen, points[chosen], bound.integrals(weight, skies), off, bound.turns))
    return bounds


def total(bounds: Sequence[Boundary], axes: int) -> tuple[Float[Array, " columns"], float]:
    """The sums of the integrals of some boundaries, and the error of the first column; axes: number of coordinates."""
    integrals = np.sum([np.zeros(axes + 1), *(one.integrals for one in bounds)], axis=0)
    return integrals, sum(one.error for one in bounds)


def closed(arcs: BoundaryArcs, sign: Float[Array, " arcs"]) -> bool:
    """True if, with the image to the left, as many arcs arrive at every node as leave it, all at one place."""
    most = 1 + max(arcs.left.max(), arcs.right.max())
    balanced = (np.bincount(arcs.left, sign, most) == np.bincount(arcs.right, sign, most)).all()
    ends = np.concatenate([arcs.start, arcs.stop])
    size = lengths(np.diff(with_ends(arcs.start, arcs.points, arcs.stop), axis=1)).sum(axis=1)
    gap = lengths(at_nodes(arcs.left, arcs.right, ends) - ends)
    return bool(balanced and (gap <= _WIDEST_GAP * np.tile(size, 2)).all())


def seen_points(sky: SearchSky, arcs: BoundaryArcs) -> tuple[Float[Array, "arcs nodes axes"], Float[Array, " arcs"]]:
    """Nodes of arcs between both ends, and the error of the area beside each, on the viewer's sky."""
    # Arcs that meet share their ends: a gap would add an area along the whole boundary.
    start, stop = np.split(at_nodes(arcs.left, arcs.right, np.concatenate([arcs.start, arcs.stop])), 2)
    whole = with_ends(start, arcs.points, stop)
    flat = whole.reshape(-1, 3)
    places = sky.to_viewer(flat)
    scale = sky.lengths(flat).reshape(whole.shape[:2])
    return places.reshape(*whole.shape[:2], places.shape[-1]), arcs.error * (scale**2).max(axis=1)


def flat_from_hole(places: Float[Array, "*batch axes"], hole: Float[Array, " axes"]) -> Complex[Array, "*batch"]:
    """Places in a plane on which the hole is infinitely far away and angles are true; NaN for the hole's own place."""
    with np.errstate(divide="ignore", invalid="ignore"):
        if len(hole) == 2:
            away = places - hole
            plane = 1 / (away[..., 1] + 1j * away[..., 0])
        else:
            first, second = (axis[0] for axis in tangent_basis(-hole[None]))
            plane = (places @ first + 1j * (places @ second)) / (1 - places @ hole)
    return np.where(np.isfinite(plane), plane, np.nan)


def winding(
    plane: Complex[Array, "arcs nodes"], sign: Float[Array, " arcs"], place: Complex[Array, " places"]
) -> Float[Array, " places"]:
    """The winding numbers of boundaries about places, in such a plane; plane: nodes of arcs between both ends.

    Seen from a place, a step from node to node is as good as the arc if its angle is small; others are divided.
    """
    curves = plane @ np.linalg.inv(_VALUES).T
    which, arc, step = (axis.ravel() for axis in np.indices((len(place), len(plane), plane.shape[1] - 1)))
    low, high = _ENDED[step], _ENDED[step + 1]
    turns = np.zeros(len(place))
    for _ in range(_MOST_HALVINGS):
        first, second = (_on_curve(curves[arc], at) - place[which] for at in (low, high))
        angle = np.angle(second * first.conj())
        good = np.abs(angle) < _SMALL_ANGLE
        np.add.at(turns, which[good], (sign[arc] * angle)[good])
        turns[which[np.isnan(angle)]] = np.nan
        retried = ~good & np.isfinite(turns[which])
        which, arc, low, high = which[retried], arc[retried], low[retried], high[retried]
        # An arc that passes a place, or points of it that are lost, would be divided without end.
        if not 0 < len(which) < _MOST_STEPS:
            break
        middle = (low + high) / 2
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        which, arc = np.tile(which, 2), np.tile(arc, 2)
    turns[which] = np.nan
    return turns / (2 * math.pi)


def _on_curve(coefficients: Complex[Array, "steps nodes"], at: Float[Array, " steps"]) -> Complex[Array, " steps"]:
    return np.einsum("sn,sn->s", coefficients, legendre.legvander(at, coefficients.shape[1] - 1))


def turns_about(place: Float[Array, " axes"], points: Float[Array, "arcs nodes axes"]) -> Float[Array, " arcs"]:
    """Turns by which the azimuth about a place grows along arcs."""
    if len(place) == 3:
        first, second = (axis[0] for axis in tangent_basis(place[None]))
        away = points @ first + 1j * (points @ second)
    else:
        # alpha and beta lie as the second and the first tangent do.
        away = (points[..., 1] - place[1]) + 1j * (points[..., 0] - place[0])
    steps = np.angle(away[:, 1:] * away[:, :-1].conj())
    return steps.sum(axis=1) / (2 * math.pi)


class _BoundaryIntegral:
    """A connected boundary: places (arcs, nodes with both ends, axes), the side of the image, and the hole."""

    def __init__(self, points: Array, sign: Array, hole: Array) -> None:
        self._points, self._sign = points, sign
        self.turns = round(float(sign @ turns_about(hole, points)))
        flat = points.reshape(-1, points.shape[-1])
        self._beyond = 0
        if points.shape[-1] == 2:
            self._origin = flat.mean(axis=0)
            return
        self._origin = unit(flat.mean(axis=0))
        if self.turns or (flat @ self._origin).min() < _LEAST_COSINE:
            side = 1.0 if (flat @ hole).min() > -(flat @ hole).max() else -1.0
            self._origin = side * hole
            # An origin opposite to the hole gives the area of the other side.
            self._beyond = 0 if side > 0 else self.turns

    def integrals(self, weight: Weight | None, skies: int) -> Array:
        """Integrals of the weight, and of the weight times the place, over the area and a number of whole skies.

        Both are averaged along the rays from the origin, by Gauss's rule.
        """
        averages = 0.0
        for part, share in zip(_PARTS, _SHARES, strict=True):
            places = self._toward(part)
            bright = np.ones(places.shape[:2]) if weight is None else weight(places)
            averages = averages + share * bright[..., None] * np.concatenate(
                [np.ones_like(places[..., :1]), places], -1
            )
        swept = self._sign @ np.einsum("an,anc->ac", self._swept(), averages)
        # Small images keep their digits: no sky is added that is taken off again.
        skies += self._beyond
        return swept + skies * _of_sky(weight) if skies else swept

    def _toward(self, part: float) -> Array:
        """Places at a part of the distance from the origin to the points; on a sphere the square of it is an area."""
        away = self._points - self._origin
        if away.shape[-1] == 2:
            return self._origin + part * away
        far = lengths(away) ** 2 / 2
        near = part * part * far
        sine, far_sine = (np.sqrt(np.maximum(x * (2 - x), 0)) for x in (near, far))
        across = away + far[..., None] * self._origin
        return self._origin * (1 - near)[..., None] + across * (sine / np.where(far_sine == 0, 1, far_sine))[..., None]

    def _swept(self) -> Float[Array, "arcs nodes"]:
        """Areas swept by the ray from the origin along arcs, divided among the nodes and both ends.

        The ends of the polynomials are joined to the nodes by straight steps.
        """
        x, y = np.moveaxis(self._lambert(self._points), -1, 0)
        inner_x, inner_y = x[:, 1:-1], y[:, 1:-1]
        swept = (inner_x * (inner_y @ DERIVATIVE.T) - inner_y * (inner_x @ DERIVATIVE.T)) * WEIGHTS
        (x_0, x_1), (y_0, y_1) = ((inner @ AT_ENDS.T).T for inner in (inner_x, inner_y))
        first = x[:, 0] * y_0 - y[:, 0] * x_0
        last = x_1 * y[:, -1] - y_1 * x[:, -1]
        return np.concatenate([first[:, None], swept, last[:, None]], axis=1) / 2

    def _lambert(self, points: Array) -> Array:
        """Coordinates in which areas are true, right-handed with the tangents of the sky."""
        if points.shape[-1] == 2:
            return (points - self._origin)[..., ::-1]
        scale = np.sqrt(2 / (1 + points @ self._origin))
        first, second = (axis[0] for axis in tangent_basis(self._origin[None]))
        return scale[..., None] * np.stack([points @ first, points @ second], axis=-1)


def _of_sky(weight: Weight | None) -> Float[Array, " 4"]:
    """Integrals of the weight, and of the weight times the place, over the whole sky."""
    if weight is None:
        return np.array([4 * math.pi, 0, 0, 0])
    cosine, shares = legendre.leggauss(_SKY_NODES)
    azimuth = math.pi * np.arange(2 * _SKY_NODES) / _SKY_NODES
    places = from_angles(np.arccos(cosine)[:, None], azimuth)
    bright = weight(places) * shares[:, None] * math.pi / _SKY_NODES
    return np.concatenate([[bright.sum()], np.einsum("ij,ijx->x", bright, places)])
