"""The images of a disc on a sphere that rays reach once: areas by Morse index, certified that none is missing."""

import math
from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.extended_sources.arcs.area import (
    Weight,
    boundaries,
    closed,
    flat_from_hole,
    total,
    turns_about,
    winding,
)
from kerrcaustics.extended_sources.arcs.boundary_arcs import BoundaryArcs, with_ends
from kerrcaustics.extended_sources.arcs.image_areas import AREA_TOLERANCE, DiscImages, summed
from kerrcaustics.extended_sources.sheets.about_axis import AxialLimb, symmetric
from kerrcaustics.extended_sources.sheets.critical_arcs import LimbCrossings, critical_arcs
from kerrcaustics.extended_sources.sheets.limb import GuessedArcs, Limb
from kerrcaustics.extended_sources.sheets.limb_guesses import from_level_curve, without_caustic
from kerrcaustics.extended_sources.sheets.nearby_caustics import distance, refined_near
from kerrcaustics.images.search import ImageSearch, search
from kerrcaustics.images.sheets import Sheets, sheets_of
from kerrcaustics.lens_map.search_sky import SearchSky, search_sky
from kerrcaustics.level_curves.branches import Branches
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.sphere import from_angles, moved
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Distance of the nearest caustic from the centre, in radii, above which a few points of the limb are enough.
_CLEAR = 1.05
# Longest step, radians, between points of the limb from which its arcs are guessed.
_LONGEST_STEP = math.radians(30.0)
# Places that may serve as probes of the winding of the boundary: distances from the centre in radii, and azimuths.
_PROBES = np.array(
    [(0.0, 0.0), *((0.3 + 0.06 * i, 2.4 * i) for i in range(9)), *((1.2 + 0.05 * i, 2.4 * i) for i in range(6))]
)
# Probes in the disc, those farthest from the caustics.
_INSIDE = 2
# Probes beside the disc.
_BESIDE_IT = 1
# Least area of all images, as a part of the largest area that a boundary encloses.
_LEAST_PART = 1e-3
# Largest difference of a winding number from a whole number.
_ROUND = 1e-3


def disc_images_on_sheets(
    viewer: Viewer,
    surface: End,
    centre: Float[Array, " 3"],
    angle: float,
    max_index: int,
    weight: Weight | None,
    tolerance: float = AREA_TOLERANCE,
) -> DiscImages:
    """The images of a disc on a sphere that rays reach once; parameters as for `disc_images`."""
    limb_circle = Circle.from_centre(centre, angle)
    sheets = refined_near(sheets_of(viewer, max_index, surface), limb_circle)
    sky = search_sky(viewer)
    limb = _limb(sheets, viewer, limb_circle, tolerance)
    arcs = limb.arcs
    critical, lost = _critical(sheets, limb_circle, limb)
    whole = arcs.joined(critical)
    hole = _searched_hole(sheets)
    is_limb = np.arange(len(whole)) < len(arcs)
    parity = _parity(whole)
    # A critical curve bounds the images of its own order on the side of the hole, and those of one less beyond.
    side = _sense(sheets, sky, sky.to_viewer(hole[None])[0])

    def signs(index: int | None) -> Float[Array, " arcs"]:
        if index is None:
            return np.select([is_limb, whole.index == max_index + 1], [parity, -side], 0.0)
        outer, inner = ~is_limb & (whole.index == index), ~is_limb & (whole.index == index + 1)
        return np.select([is_limb & (whole.index == index), outer, inner], [parity, side, -side], 0.0)

    area = 4 * math.pi * math.sin(angle / 2) ** 2
    disc = summed(sky, hole, (angle, area), whole, signs, max_index, weight)
    probes = limb.probes or _Probes.searched_for(sheets, limb_circle)
    wrong = _checked(sheets, disc.arcs, disc.sign, probes) + _about_viewer(sheets, limb_circle)
    return disc.with_remarks(limb.doubts, limb.faults + lost + wrong)


def _about_viewer(sheets: Sheets, limb_circle: Circle) -> tuple[str, ...]:
    """The fault of a disc about the viewer on the viewer's own sphere: its image ends where rays leave horizontally."""
    place = from_angles(sheets.camera.inclination, 0.0)
    if not sheets.curves.domain.level or limb_circle.height(place[None])[0] < 0:
        return ()
    return ("the viewer lies within the disc",)


@dataclass(frozen=True, eq=False)
class _Probes:
    """Places in a disc and beside it, and the search for their images.

    radius: Distances from the centre of the disc, in radii.
    search: The search; its first places are these.
    """

    radius: Float[Array, " probes"]
    search: ImageSearch

    @classmethod
    def searched_for(cls, sheets: Sheets, limb_circle: Circle) -> "_Probes":
        """Places farthest from the caustics."""
        radius, place = _probes(sheets, limb_circle, beside_caustics=True)
        return cls(radius, search(sheets, place))


@dataclass(frozen=True, eq=False)
class _FollowedLimb:
    """The images of the limb of a disc.

    arcs: Arcs along them.
    crossings: Crossings of caustics with the limb; None if no caustic is near.
    tolerance: Error of areas, square radians.
    doubts, faults: As for `DiscImages.with_remarks`.
    probes: The probes, if their images were searched together with the limb.
    """

    arcs: BoundaryArcs
    crossings: LimbCrossings | None
    tolerance: float
    doubts: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()
    probes: _Probes | None = None


def _limb(sheets: Sheets, viewer: Viewer, limb_circle: Circle, part: float) -> _FollowedLimb:
    """The limb from a few images, about an axis, or followed through folds; part: relative error of the area."""
    nearest = min(distance(curve, limb_circle.axes[2]) for curve in sheets.curves)
    if nearest > _CLEAR * limb_circle.angle:
        radius, place = _probes(sheets, limb_circle, beside_caustics=False)
        guessed, searched = without_caustic(sheets, limb_circle, place)
        if guessed is not None:
            followed = _limb_from_guesses(sheets, limb_circle, guessed, None, (), part)
            # Beside a caustic that is a point images are drawn out to rings.
            if not (followed.doubts and symmetric(sheets)):
                return replace(followed, probes=_Probes(radius, searched))
    if symmetric(sheets):
        limb = AxialLimb(sheets, limb_circle)
        tolerance = part * _rough_area(limb.arcs(math.inf), sheets)
        touched = [
            curve.order for curve in sheets.curves if abs(limb_circle.height(curve.points.direction)).min() < curve.blur
        ]
        faults = tuple(f"the limb passes the caustic of order {k}, which is a point" for k in touched)
        return _FollowedLimb(limb.arcs(tolerance), LimbCrossings.empty(), tolerance, (), faults)
    branches = Branches(sheets, viewer, limb_circle, _LONGEST_STEP)
    events = branches.events
    faults = [*events.remarks, *branches.remarks]
    if not events.known.all():
        faults.append(f"the counts beside {(~events.known).sum()} events on the limb are not what they should be")
    crossings = LimbCrossings(events.order, events.points.edge_phase)
    return _limb_from_guesses(sheets, limb_circle, from_level_curve(branches), crossings, tuple(faults), part)


def _limb_from_guesses(
    sheets: Sheets,
    limb_circle: Circle,
    guessed: GuessedArcs,
    crossings: LimbCrossings | None,
    faults: tuple[str, ...],
    part: float,
) -> _FollowedLimb:
    """The limb by Newton's method from guesses."""
    tolerance = part * _rough_area(guessed.arcs(), sheets)
    first = _next_node(guessed.links.left, guessed.links.right)
    limb = Limb(sheets.camera, sheets.surface, limb_circle, ended=crossings is None)
    arcs, doubtful = limb.arcs(guessed, first, tolerance)
    doubts = (f"{doubtful} arcs of the limb are in doubt",) if doubtful else ()
    return _FollowedLimb(arcs, crossings, tolerance, doubts, faults)


def _rough_area(arcs: BoundaryArcs, sheets: Sheets) -> float:
    """The approximate area of the images on the search sky, square radians."""
    points = with_ends(arcs.start, arcs.points, arcs.stop)
    hole = _searched_hole(sheets)
    bounds = boundaries(arcs, points, arcs.error, _parity(arcs), hole)
    return max(abs(float(total(bounds, len(hole))[0][0])), _LEAST_PART * max(abs(one.area) for one in bounds))


def _searched_hole(sheets: Sheets) -> Float[Array, " 3"]:
    """The direction to the hole on the search sky."""
    return sheets.sky(np.array([[-1.0, 0.0, 0.0]]))[0]


def _next_node(left: Int[Array, " arcs"], right: Int[Array, " arcs"]) -> int:
    """The first number that no node at the ends of arcs has."""
    return 1 + int(max(left.max(), right.max()))


def _parity(arcs: BoundaryArcs) -> Float[Array, " arcs"]:
    return 1.0 - 2 * (arcs.index % 2)


def _critical(sheets: Sheets, limb_circle: Circle, limb: _FollowedLimb) -> tuple[BoundaryArcs, tuple[str, ...]]:
    """The arcs of all critical curves within the images of the disc, and remarks."""
    critical, remarks = limb.arcs[:0], ()
    if limb.crossings is None:
        return critical, remarks
    for curve in sheets.curves:
        whole = limb.arcs.joined(critical)
        first = _next_node(whole.left, whole.right)
        more, doubts = critical_arcs(sheets, limb_circle, limb.crossings, curve, first, limb.tolerance)
        critical, remarks = critical.joined(more), remarks + doubts
    return critical, remarks


def _sense(sheets: Sheets, sky: SearchSky, hole: Float[Array, " axes"]) -> float:
    """1 where critical curves run round the hole anticlockwise as their edge phase grows, else -1."""
    curve = sheets.curves.curves[-1]
    places = sky.to_viewer(sheets.sky(curve.points.line_of_sight))
    return float(np.sign(turns_about(hole, places[None])[0]))


def _checked(sheets: Sheets, arcs: BoundaryArcs, sign: Float[Array, " arcs"], probes: _Probes) -> tuple[str, ...]:
    """Faults of the boundary of the images: ends of arcs, and windings about images of places.

    Places within the disc must have all of their images within the boundary, others none.
    """
    if not closed(arcs, sign):
        return ("the boundary of the images is not closed",)
    radius, searched = probes.radius, probes.search
    sure = searched.certified.copy()
    sure[len(radius) :] = False
    if not (sure[: len(radius)] & (radius < 1)).any():
        return ("no place within the disc has certified images",)
    images = searched.images[sure[searched.images.star]]
    # On the search sky, where images next to the hole are as large as others.
    hole = _searched_hole(sheets)
    points = with_ends(arcs.start, arcs.points, arcs.stop)
    plane, places = flat_from_hole(points, hole), flat_from_hole(images.sky, hole)
    about = winding(plane, sign, places)
    expected = radius[images.star] < 1
    wrong = int((np.abs(about - expected) > _ROUND).sum())
    return (f"{wrong} of {len(about)} images of places in and beside the disc lie on the wrong side",) if wrong else ()


def _probes(
    sheets: Sheets, limb_circle: Circle, *, beside_caustics: bool
) -> tuple[Float[Array, " probes"], Float[Array, "probes 3"]]:
    """Places in the disc and beside it, far from caustics: distances from its centre, in radii, and directions."""
    radius, azimuth = _PROBES[_PROBES[:, 0] * limb_circle.angle < math.pi].T
    centre = np.tile(limb_circle.axes[2], (len(radius), 1))
    step = np.cos(azimuth)[:, None] * limb_circle.axes[0] + np.sin(azimuth)[:, None] * limb_circle.axes[1]
    place = moved(centre, (radius * limb_circle.angle)[:, None] * step)
    far = np.argsort(-sheets.expected_counts(place).distance) if beside_caustics else np.arange(len(radius))
    chosen = np.concatenate([far[radius[far] < 1][:_INSIDE], far[radius[far] > 1][:_BESIDE_IT]])
    return radius[chosen], place[chosen]
