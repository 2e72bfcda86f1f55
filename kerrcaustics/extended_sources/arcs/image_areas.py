"""The areas of the images of a disc on a viewer's sky."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.extended_sources.arcs.area import Boundary, Weight, boundaries, seen_points, total
from kerrcaustics.extended_sources.arcs.boundary_arcs import BoundaryArcs
from kerrcaustics.lens_map.search_sky import SearchSky
from kerrcaustics.shapes import Float, Int

Array = np.ndarray

AREA_TOLERANCE = 1e-10
"""Relative error of the area that is aimed at unless another one is requested."""


@dataclass(frozen=True, eq=False)
class DiscImages:
    """The images of a disc on a viewer's sky.

    angle: Radius of the disc, radians, in the plane a length.
    solid_angle: Solid angle of the disc from the centre of its sphere, in the plane its area; weighted by brightness.
    arcs: Arcs that bound the images of all indices.
    points: Places of the arcs on the viewer's sky, between their ends.
    sign: 1 where the image lies to the left of an arc, -1 where to the right.
    boundaries: Connected boundaries of the images.
    area: Area of the images, weighted, in units of the sky.
    error: Error of the area.
    shares: Area by index.
    share_errors: Errors of the shares.
    first_moment: Integral of the place over the images.
    remarks: One for each doubt, none if certified.
    """

    angle: float
    solid_angle: float
    arcs: BoundaryArcs
    points: Float[Array, "arcs nodes axes"]
    sign: Float[Array, " arcs"]
    boundaries: list[Boundary]
    area: float
    error: float
    shares: Float[Array, " indices"]
    share_errors: Float[Array, " indices"]
    first_moment: Float[Array, " axes"]
    remarks: tuple[str, ...]

    @property
    def certified(self) -> bool:
        """True without remarks."""
        return not self.remarks

    def with_remarks(self, doubts: Sequence[str], faults: Sequence[str]) -> "DiscImages":
        """The disc with further remarks: doubts, which its error covers, and faults, which make the error infinite."""
        disc = replace(self, remarks=tuple(dict.fromkeys([*faults, *doubts, *self.remarks])))
        if not (faults or self.remarks):
            return disc
        return replace(disc, error=math.inf, share_errors=np.full(len(self.shares), math.inf))

    def uncertified_unless_known(self) -> "DiscImages":
        """The disc; not certified if its error is larger than its area."""
        if not self.certified or self.error <= self.area or self.error == 0:
            return self
        return replace(self, remarks=("the error is larger than the light",))

    def interpolated(self, low: "DiscImages", high: "DiscImages") -> "DiscImages":
        """The disc with areas between those of a smaller disc and of a larger one."""
        return replace(
            low,
            angle=self.angle,
            solid_angle=self.solid_angle,
            area=(low.area + high.area) / 2,
            error=max(low.error, high.error) + abs(high.area - low.area) / 2,
            shares=(low.shares + high.shares) / 2,
            share_errors=np.maximum(low.share_errors, high.share_errors) + np.abs(high.shares - low.shares) / 2,
            first_moment=(low.first_moment + high.first_moment) / 2,
        ).uncertified_unless_known()


def summed(
    sky: SearchSky,
    hole: Float[Array, " 3"],
    disc: tuple[float, float],
    arcs: BoundaryArcs,
    signs: Callable[[int | None], Float[Array, " arcs"]],
    max_index: int,
    weight: Weight | None = None,
) -> DiscImages:
    """The areas within arcs.

    hole: direction to the hole on the search sky.
    disc: radius and area of the disc.
    signs: for one index, or for all, 1 if the images lie to the left of an arc, -1 if to the right, 0 if beside others.
    """
    points, error = seen_points(sky, arcs)
    seen_hole = sky.to_viewer(hole[None])[0]

    def bounded(sign: Float[Array, " arcs"]) -> list[Boundary]:
        chosen = np.flatnonzero(sign)
        if not len(chosen):
            return []
        return boundaries(arcs[chosen], points[chosen], error[chosen], sign[chosen], seen_hole, weight)

    shares, share_errors = np.zeros(max_index + 1), np.zeros(max_index + 1)
    for k in range(max_index + 1):
        (shares[k], *_), share_errors[k] = total(bounded(signs(k)), len(seen_hole))
    sign = signs(None)
    bounds = bounded(sign)
    integrals, off = total(bounds, len(seen_hole))
    adds_up = abs(shares.sum() - integrals[0]) <= share_errors.sum() + off
    chosen = sign != 0
    return DiscImages(
        angle=disc[0],
        solid_angle=disc[1],
        arcs=arcs[chosen],
        points=points[chosen],
        sign=sign[chosen],
        boundaries=bounds,
        area=float(integrals[0]),
        error=off,
        shares=shares,
        share_errors=share_errors,
        first_moment=integrals[1:],
        remarks=() if adds_up else ("the shares of all Morse indices do not add up to the whole",),
    )


def outline_of(disc: DiscImages, bound: Boundary) -> tuple[Float[Array, "points axes"], Int[Array, " points"]]:
    """Places along a boundary, the image to the left, with the Morse index of the images there."""
    left, right = (side[bound.arcs].tolist() for side in (disc.arcs.left, disc.arcs.right))
    at: dict[int, list[int]] = {}
    for arc, pair in enumerate(zip(left, right, strict=True)):
        for node in pair:
            at.setdefault(node, []).append(arc)
    sky, index, unused = [], [], set(range(len(left)))
    arc, node = 0, (left if disc.sign[bound.arcs[0]] > 0 else right)[0]
    while arc in unused:
        unused.discard(arc)
        forward = node == left[arc]
        points = bound.points[arc][:-1] if forward else bound.points[arc][:0:-1]
        sky.append(points)
        # Arcs of the last critical curve have its order, which is one more than the highest index.
        index.append(np.full(len(points), min(disc.arcs.index[bound.arcs[arc]], len(disc.shares) - 1)))
        node = right[arc] if forward else left[arc]
        arc = next((candidate for candidate in at[node] if candidate in unused), -1)
    return np.concatenate(sky), np.concatenate(index)
