"""The limb of a disc on the camera sky: arcs along the curve on which light comes from the disc's limb.

The angle from the centre of the disc at which light from the direction N leaves the surface is a smooth function of N,
at folds too: its gradient is J^T u, with u the unit vector away from the centre. The distance of a curve from the limb
times its length is the error of the area that it bounds; errors along the curve do not matter. Newton's method leads
points to the limb at their longitude; next to folds, where it would lead far along the limb, steps follow the gradient.
"""

from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import End
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.extended_sources.arcs.boundary_arcs import (
    DERIVATIVE,
    GUESSED,
    NODES,
    WEIGHTS,
    Attempt,
    BoundaryArcs,
    arc_values,
    arcs_by_halving,
    at_nodes,
    values_at,
    with_ends,
)
from kerrcaustics.lens_map.search_sky import TOLERANCE
from kerrcaustics.lens_map.sky_chart import chart_of
from kerrcaustics.level_curves.links import Links
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import flattened, lengths, tangent_basis, unit
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
# Places of arcs, a row for each arc.
_Places = Float[Array, "arcs nodes 3"]
_Reals = Float[Array, "arcs nodes"]
_OfArcs = Float[Array, " arcs"]

# Rounds of halving.
_MOST_HALVINGS = 16
# Newton steps of the ends of arcs toward the limb.
_STEPS = 3
# Arcs that are halved together, at most: more are a sign that the limb is lost.
_MOST_ARCS = 5000
# Longest Newton step, in lengths of the arc.
_LONGEST_STEP = 0.25
# Longest Newton step next to a fold, in lengths of the arc: J^-1 is uncertain there.
_LONGEST_AT_FOLD = 0.02
# Longest step along the gradient, in lengths of the arc.
_LONGEST_PART = 0.3
# Cosine of the angle between arc and gradient above which the arc has lost the limb.
_MOST_COSINE = 0.5
# Longest turn about the hole of arcs of images of index 2 that are moved along the limb, radians.
_LONGEST_TURN = 0.002
# Factor of this turn for each higher index: the square root of the factor of the layers' thickness.
_THINNER = 0.2
# Error of an arc over that of its rays below which halving gains nothing.
_ROUND_OFF = 5.0

_ENDED_GUESS, _ENDED = (np.concatenate([[-1.0], nodes, [1.0]]) for nodes in (GUESSED, NODES))
_TO_NODES = values_at(_ENDED_GUESS, NODES)
_HALVES = [values_at(_ENDED, (GUESSED + side) / 2) for side in (-1, 1)]
_MIDDLE = np.zeros(1)
_TO_MIDDLE = values_at(_ENDED, _MIDDLE)


@dataclass(frozen=True)
class GuessedArcs(Rows):
    """Arcs near the limb.

    links: Links between nodes of a level curve.
    at_fold: True for arcs from a link that ends at a fold.
    start, stop: Directions of the nodes.
    guess: Directions at `GUESSED`.
    """

    links: Links
    at_fold: Bool[Array, " arcs"]
    start: Float[Array, "arcs 3"]
    stop: Float[Array, "arcs 3"]
    guess: Float[Array, "arcs guesses 3"]

    def arcs(self) -> BoundaryArcs:
        """The guesses as arcs, not brought to the limb."""
        points, links = unit(arc_values(_TO_NODES, with_ends(self.start, self.guess, self.stop))), self.links
        return BoundaryArcs(links.index, links.left, links.right, self.start, self.stop, points, np.zeros(len(points)))


@dataclass(frozen=True)
class Offset:
    """Offsets of directions from the limb.

    length: Angles to the limb, radians, positive outside the image of the disc.
    inward: Unit vectors toward the image.
    error: Errors of the lengths, radians.
    """

    length: Float[Array, "*batch"]
    inward: Float[Array, "*batch 3"]
    error: Float[Array, "*batch"]


@dataclass(frozen=True)
class Limb:
    """The limb of a disc on a surface, for a viewer at rest.

    camera: The viewer at rest.
    surface: The surface.
    circle: The circle that the limb of the disc is on its surface.
    evenly: True to keep the points of long arcs evenly spread, in the thin layers next to the hole that they resolve.
    ended: True if the ends of guesses are certified images of points of the limb.
    """

    camera: Viewer
    surface: End
    circle: Circle
    evenly: bool = False
    ended: bool = False

    def arcs(self, guessed: GuessedArcs, first: int, tolerance: float) -> tuple[BoundaryArcs, int]:
        """Arcs on the limb from guesses, and the number of arcs in doubt.

        first: number of the first new node; tolerance: error of the whole area, square radians.
        """
        arcs, doubtful = self._arcs(guessed, first, tolerance)
        if doubtful:
            even_arcs, fewer = replace(self, evenly=True)._arcs(guessed, first, tolerance)
            if fewer < doubtful:
                return even_arcs, fewer
        return arcs, doubtful

    def _arcs(self, guessed: GuessedArcs, first: int, tolerance: float) -> tuple[BoundaryArcs, int]:
        size = _lengths_of(with_ends(guessed.start, guessed.guess, guessed.stop))
        ends, part = np.concatenate([guessed.start, guessed.stop]), np.repeat([-1.0, 1.0], len(guessed))
        if not self.ended:
            ends = self._on_limb(ends, guessed.joined(guessed), part, np.tile(size, 2))
        # Arcs that meet move their common node to different places along the limb.
        start, stop = np.split(at_nodes(guessed.links.left, guessed.links.right, ends), 2)
        guessed = replace(guessed, start=start, stop=stop)

        def attempt(pieces: tuple[GuessedArcs, Array]) -> Attempt[tuple[GuessedArcs, Array], BoundaryArcs]:
            (guessed, size), links = pieces, pieces[0].links
            guess = self._moved(guessed.guess, guessed, GUESSED[None], size)[0]
            points = unit(arc_values(_TO_NODES, with_ends(guessed.start, guess, guessed.stop)))
            rate = arc_values(DERIVATIVE, points)
            speed = lengths(rate)
            size = speed @ WEIGHTS
            points, offset = self._moved(points, guessed, NODES[None], size)
            beside, noise = ((part * speed) @ WEIGHTS for part in (np.abs(offset.length), offset.error))
            lost = (np.abs(np.einsum("anx,anx->an", rate, offset.inward)) > _MOST_COSINE * speed).any(axis=1)
            good = ~lost & ((beside <= tolerance / len(links)) | (beside <= _ROUND_OFF * noise))
            ends = links.left, links.right, guessed.start, guessed.stop
            return Attempt(
                BoundaryArcs(links.index, *ends, points, beside + noise),
                good,
                lambda chosen, first: self._halved(guessed[chosen], points[chosen], size[chosen], first),
            )

        return arcs_by_halving((guessed, size), attempt, first, _MOST_HALVINGS, _MOST_ARCS)

    def _halved(
        self, guessed: GuessedArcs, points: _Places, size: _OfArcs, first: int
    ) -> tuple[GuessedArcs, Float[Array, " halves"]]:
        """Both halves of arcs, and their sizes; points: at `NODES`; first: number of the first new node."""
        links, whole = guessed.links, with_ends(guessed.start, points, guessed.stop)
        middle = self._on_limb(unit(arc_values(_TO_MIDDLE, whole))[:, 0], guessed, np.zeros(len(links)), size)
        new, p = first + np.arange(len(links)), (links.p_0 + links.p_1) / 2
        start, stop = (unit(arc_values(half, whole)) for half in _HALVES)
        halves = replace(guessed, links=replace(links, right=new, p_1=p), stop=middle, guess=start).joined(
            replace(guessed, links=replace(links, left=new, p_0=p), start=middle, guess=stop)
        )
        return halves, np.tile(size / 2, 2)

    def _on_limb(
        self, sky: Float[Array, "arcs 3"], arcs: GuessedArcs, part: _OfArcs, size: _OfArcs
    ) -> Float[Array, "arcs 3"]:
        """Directions at a place along each arc, in (-1, 1), brought to the limb."""
        for _ in range(_STEPS):
            sky = self._moved(sky[:, None], arcs, part[:, None], size)[0][:, 0]
        return sky

    def _moved(
        self, sky: _Places, arcs: GuessedArcs, parts: Float[Array, "#arcs nodes"], size: _OfArcs
    ) -> tuple[_Places, Offset]:
        """Directions moved toward the limb, and their offsets from it before.

        parts: places of the directions along arcs, in (-1, 1); size: lengths of the arcs, radians.
        """
        shape, flat = sky.shape, sky.reshape(-1, 3)
        beams = beams_of_directions(
            self.camera, flat, "auto", TOLERANCE, end=self.surface.bare(), crossings=False, redshift=False
        )
        offset = self.offset(flat, beams)
        star = self.circle.place(_longitude(arcs.links, parts).ravel())
        step = beams.pulled_back(flat, flattened(beams.direction, star - beams.direction))
        most = np.where(arcs.at_fold, _LONGEST_AT_FOLD, _LONGEST_STEP) * size
        # Not along the limb, where J^-1 is uncertain, and not to other images.
        deep = arcs.links.index - 2
        turn = size / np.hypot(arcs.start[:, 1], arcs.start[:, 2])
        most[self.evenly & (deep >= 0) & (turn > _LONGEST_TURN * _THINNER ** np.maximum(deep, 0))] = 0
        far = ~(lengths(step) < np.repeat(most, shape[1]))
        size = np.repeat(size, shape[1])
        most = _LONGEST_PART * size[far]
        step[far] = np.clip(np.nan_to_num(offset.length[far], posinf=0), -most, most)[:, None] * offset.inward[far]
        offsets = Offset(*(values.reshape(shape[:2] + values.shape[1:]) for values in vars(offset).values()))
        # Steps follow the layers of images next to the hole, which are thinner than the sagitta of a straight step.
        reached = chart_of(self.camera).stepped(flat, step, np.ones(len(flat)))[0]
        return reached.reshape(shape), offsets

    def offset(self, sky: Float[Array, "n 3"], beams: Beams) -> Offset:
        """Offsets from the limb of directions that have been traced."""
        upward = flattened(beams.direction, self.circle.upward_and_east(beams.direction)[0])
        start, stop = np.einsum("nij,ni->jn", beams.jacobian, upward)[..., None]
        first, second = tangent_basis(sky)
        gradient = start * first + stop * second
        steep = lengths(gradient)
        with np.errstate(divide="ignore", invalid="ignore"):
            inward = np.nan_to_num(gradient / steep[:, None])
            length, error = -self.circle.height(beams.direction) / steep, beams.error / steep
        return Offset(np.where(np.isfinite(length), length, np.inf), inward, error)


def _longitude(links: Links, parts: Float[Array, "#arcs nodes"]) -> _Reals:
    """Longitudes at places along links."""
    part = (1 + parts.T) / 2
    return np.stack([links.longitude(links.p_0 + t * (links.p_1 - links.p_0)) for t in part], axis=1)


def _lengths_of(points: _Places) -> _OfArcs:
    return lengths(np.diff(points, axis=1)).sum(axis=1)
