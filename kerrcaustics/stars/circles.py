"""Images of a great circle of the celestial sphere: curves on the camera sky, with a certificate.

On a sheet of the camera sky (sheets.py) the sky map has no fold, so the image of a great circle is a set of smooth
curves along which the longitude on the circle runs one way, each closed or from one critical curve to another. A grid
finds them, Newton's method puts their points on the circle. The certificate counts: at every longitude as many curves
must pass as the star there has images, by the winding of the caustics.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from skimage.measure import find_contours

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.curves import sky_lines
from kerrcaustics.curves.critical import Points
from kerrcaustics.curves.follow import between
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.spacetime.camera import Camera, fido_from_sky, sky_from_fido
from kerrcaustics.spacetime.sphere import from_angles, polar_basis, tangent_basis
from kerrcaustics.stars.images import checked_sheets, checked_stars
from kerrcaustics.stars.sheets import Sheet, Sheets
from kerrcaustics.stars.winding import Edge

Array = np.ndarray

GALACTIC_POLE = (math.radians(90 - 27.12825), math.radians(192.85948))
"""North galactic pole (theta', phi') where theta' = 90 deg - declination and phi' = right ascension (J2000)."""

# Parts of a sheet next to its edges where no grid is laid, and nodes that lead up to them.
_MARGIN = 1e-3
_NEAR_EDGE = _MARGIN * 2.0 ** np.arange(6)
# How much finer than that of the sheets the grid is, at first and when its curves do not fit the count.
_FINER = (2, 4, 8)
# A turn that is no line of symmetry, where the grid's seam lies.
_SEAM = 0.7
_NEWTON_STEPS = 12
_SECANTS = 40
_TOLERANCE = 1e-12
# A caustic that is smaller than so many errors of its points is a point.
_POINT = 3.0
# Points of a curve are no closer than this in longitude.
_CLOSEST = 1e-7
# Farthest critical point, as a longitude, at which a curve may end that runs up to the grid's last column.
_LAST_STEP = 0.5
# Longitudes that are counted, beside one between each two neighbouring caustics.
_LONGITUDES = 360


@result("circle-curve/1", record="index closed longitude_from longitude_to ends error", points="sky longitude")
class CircleCurve:
    """One image of a great circle, or of a part of it: a curve on the camera sky."""

    index: int = quantity("", "1", "Morse index")
    sky: Array = quantity("point axis", "1", "directions N")
    longitude: Array = quantity("point", "rad", "longitude on the circle, unwrapped, growing")
    closed: bool = quantity(
        "",
        "1",
        "True where the curve returns to its first point (not repeated), else it ends at critical curves",
    )
    error: float = quantity("", "rad", "the largest error of the points on the sky", json="error_rad")

    @property
    @derived("", "rad")
    def longitude_from(self) -> float:
        """Longitude at which the curve begins."""
        return float(self.longitude[0])

    @property
    @derived("", "rad")
    def longitude_to(self) -> float:
        """Longitude at which the curve ends, unwrapped."""
        return float(self.longitude[0] + self.sweep)

    @property
    @derived("curve_end axis", "1")
    def ends(self) -> Array:
        """Directions N of both ends of an open curve."""
        return self.sky[:0] if self.closed else self.sky[[0, -1]]

    @property
    def sweep(self) -> float:
        """Longitude swept, radians; a whole number of circuits where the curve is closed."""
        swept = float(self.longitude[-1] - self.longitude[0])
        return 2 * math.pi * math.ceil(swept / (2 * math.pi)) if self.closed else swept


@result("counts/1", record="camera kind=circle max_index normal certified remarks per_index curves")
class CircleImages:
    """The images of a great circle, by Morse index.

    Longitude on the circle is counted from its ascending node on the celestial equator (from phi' = 0 where it is the
    equator), right-handed about the normal.
    """

    camera: Camera = quantity("", "", "the camera", json="", column="")
    normal: tuple[float, float] = quantity("angle", "rad", "theta', phi' of the circle's normal", given=True)
    curves: tuple[CircleCurve, ...] = quantity("curve", "", "its images, by index")
    per_index: dict[int, int] = quantity("morse_index", "1", "how many curves of each index")
    certified: bool = quantity(
        "", "1", "True when at every longitude as many curves pass as the winding of the caustics tells"
    )
    remarks: tuple[str, ...] = quantity("", "", "what is not sure", default=())

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index that was asked for."""
        return max(self.per_index)

    def __repr__(self) -> str:
        """One line: the normal, how many curves, whether certified."""
        counts = ", ".join(f"{count} of index {k}" for k, count in self.per_index.items())
        note = "" if self.certified else ", not certified"
        return f"<CircleImages of the great circle with normal {self.normal}: {counts}{note}>"


class Circle:
    """A great circle of the celestial sphere: height above it, and longitude on it."""

    def __init__(self, angles: tuple[float, float]) -> None:
        """The circle whose normal has these theta', phi'."""
        self.angles = angles
        self.normal = from_angles(*angles)
        e_theta, e_phi = polar_basis(self.normal) if math.sin(angles[0]) > 0 else (None, np.array([0.0, 1.0, 0.0]))
        # East of the normal, on the equator, lies the ascending node.
        self.node = e_phi if e_theta is not None else np.array([1.0, 0.0, 0.0])
        self.ahead = np.cross(self.normal, self.node)

    def height(self, direction: Array) -> Array:
        """Sine of the angle above the circle (...,) of directions (..., 3)."""
        return direction @ self.normal

    def longitude(self, direction: Array) -> Array:
        """Longitude (...,) in (-pi, pi] of directions (..., 3)."""
        return np.arctan2(direction @ self.ahead, direction @ self.node)

    def place(self, longitude: Array) -> Array:
        """Points (..., 3) of the circle."""
        return np.cos(longitude)[..., None] * self.node + np.sin(longitude)[..., None] * self.ahead


def circle_images(camera: Camera, normal: ArrayLike | str, max_index: int = 2) -> CircleImages:
    """The images of a great circle with Morse index 0 to `max_index`, as curves on the camera sky.

    Parameters
    ----------
    camera : Camera
    normal : (theta', phi') or "galactic plane"
        Of the circle's normal, radians; the galactic plane is that of stars with theta' = 90 deg - declination and
        phi' = right ascension.
    max_index : int
        0 to 6.

    Returns
    -------
    CircleImages

    Errors
    ------
    `CircleCurve.error`: round-off of n' divided by the beam's width across the circle.
    """
    sheets = checked_sheets(camera, max_index)
    circle = Circle(_checked_normal(normal))
    edges = [_edge_points(sheets, edge, circle) for edge in sheets.edges]
    curves: list[CircleCurve] = []
    remarks: list[str] = []
    for sheet in sheets.sheets:
        found, problem = _sheet_curves(sheets, sheet, circle, edges)
        curves += [_seen(camera, sheets, curve) for curve in found]
        remarks += problem
    counts = {s.index: sum(curve.index == s.index for curve in curves) for s in sheets.sheets}
    return CircleImages(camera, circle.angles, tuple(curves), counts, not remarks, tuple(remarks))


def _checked_normal(normal: ArrayLike | str) -> tuple[float, float]:
    if isinstance(normal, str):
        if normal == "galactic plane":
            return GALACTIC_POLE
        raise ValueError(f"Argument `normal` must be (theta', phi') or \"galactic plane\", but is {normal!r}.")
    try:
        theta, phi = (float(angle) for angle in np.asarray(normal, float))
        checked_stars([(theta, phi)])
    except (TypeError, ValueError):
        raise ValueError(
            f"Argument `normal` must be (theta', phi') in radians with theta' in [0, pi], but is {normal!r}."
        ) from None
    return theta, phi


def _seen(camera: Camera, sheets: Sheets, curve: CircleCurve) -> CircleCurve:
    """The same curve on the sky of the camera in motion."""
    motion = np.stack(fido_from_sky(sheets.frame, tuple(curve.sky.T)), axis=-1)
    return CircleCurve(curve.index, sky_from_fido(camera.frame(), motion), curve.longitude, curve.closed, curve.error)


def _sheet_curves(
    sheets: Sheets, sheet: Sheet, circle: Circle, edges: list[Points | None]
) -> tuple[list[CircleCurve], list[str]]:
    """The curves of one sheet, and what is wrong with them, in words; grids as fine as the count asks for."""
    bounds = [edges[k] for k in (sheet.index - 1, sheet.index) if k >= 0]
    test = _test_longitudes(circle, [points for points in bounds if points is not None])
    expected, touching = sheets.expected(circle.place(test))
    clear = ~touching[:, max(sheet.index - 1, 0) : sheet.index + 1].any(axis=1)
    test, expected = test[clear], expected[clear, sheet.index]
    curves: list[CircleCurve] = []
    differ = np.ones(len(test), bool)
    for finer in _FINER:
        tracks = [_refined(sheets, sheet.index, circle, sky) for sky in _contours(sheets, sheet, circle, finer)]
        curves = [_ended(sheets, circle, curve, bounds) for curve in tracks if curve is not None]
        differ = _passing(curves, test) != expected
        if not differ.any() and all(_one_way(curve) for curve in curves):
            return curves, []
    where = f"at {np.count_nonzero(differ)} of {len(test)} longitudes" if differ.any() else "where a curve turns back"
    return curves, [
        f"index {sheet.index}: the curves found do not agree with the winding of the caustics {where}; turn the normal "
        "a little and compare"
    ]


def _test_longitudes(circle: Circle, edges: list[Points]) -> Array:
    """Longitudes between neighbouring caustics, where the number of images cannot change, and some more."""
    even = -math.pi + 2 * math.pi * (np.arange(_LONGITUDES) + 0.5) / _LONGITUDES
    if not edges:
        return even
    breaks = np.sort(np.concatenate([circle.longitude(points.direction) for points in edges]))
    if len(breaks) == 0:
        return even
    return np.concatenate([even, (breaks + np.append(breaks[1:], breaks[0] + 2 * math.pi)) / 2])


def _passing(curves: list[CircleCurve], longitude: Array) -> Array:
    """How many curves (n,) pass each longitude (n,)."""
    total = np.zeros(len(longitude), int)
    for curve in curves:
        low, high = curve.longitude[0], curve.longitude[0] + curve.sweep
        total += (np.floor((high - longitude) / (2 * math.pi)) - np.floor((low - longitude) / (2 * math.pi))).astype(
            int
        )
    return total


def _one_way(curve: CircleCurve) -> bool:
    return bool((np.diff(curve.longitude) > 0).all())


def _edge_points(sheets: Sheets, edge: Edge, circle: Circle) -> Points | None:
    """Points of a critical curve whose images lie on the circle; None where the caustic is a point."""
    points = edge.points
    spread = np.linalg.norm(points.direction - points.direction.mean(axis=0), axis=1).max()
    if spread <= _POINT * points.error.max():
        return None
    height = circle.height(points.direction)
    following = np.roll(height, -1)
    side = np.flatnonzero((height > 0) != (following > 0))
    low, high = points.turn[side], np.append(points.turn[1:], points.turn[0] + 2 * math.pi)[side]
    below, above = height[side], following[side]
    closed = points[-3:].shifted(-1).joined(points, points[:3].shifted(1))
    found = points[side]
    for _ in range(_SECANTS):
        # Illinois: a bracket kept, and no end of it for ever.
        turn = np.where(below == above, low, low - below * (high - low) / np.where(below == above, 1, above - below))
        new = between(sheets.search, {edge.order: closed}, {edge.order: turn})[edge.order]
        if len(new) != len(side):
            break
        found = new
        value = circle.height(found.direction)
        left = (value > 0) == (below > 0)
        low, below, above = np.where(left, turn, low), np.where(left, value, below), np.where(left, above / 2, above)
        high, above, below = np.where(left, high, turn), np.where(left, above, value), np.where(left, below, below / 2)
        if (np.abs(value) < 10 * found.error).all():
            break
    return found


def _grid(sheet: Sheet, finer: int) -> tuple[Array, Array]:
    """Turns (m,), the last a whole turn after the first, and parts (n,) of a grid `finer` times as fine."""
    steps = np.arange(finer * (len(sheet.turn) - 1)) / finer
    turn = np.interp(steps, np.arange(len(sheet.turn)), sheet.turn)
    turn = np.sort(_SEAM + (turn - _SEAM) % (2 * math.pi))
    # Between the nodes, so that no line of symmetry is one of them.
    turn = (turn + np.append(turn[1:], turn[0] + 2 * math.pi)) / 2
    part = np.linspace(0, 1, finer * (len(sheet.part) - 1) + 1)[1:-1]
    part = np.unique(np.concatenate([part[(part > _MARGIN) & (part < 1 - _MARGIN)], _NEAR_EDGE, 1 - _NEAR_EDGE]))
    return np.append(turn, turn[0] + 2 * math.pi), part


def _contours(sheets: Sheets, sheet: Sheet, circle: Circle, finer: int) -> list[tuple[Array, bool]]:
    """First guesses: directions (n, 3) on the sky at rest of each curve, and whether it is closed."""
    turn, part = _grid(sheet, finer)
    at_turn, at_part = np.meshgrid(turn[:-1], part, indexing="ij")
    looking = sky_lines.looking(sheets.camera, at_turn, sheet.depth(at_turn, at_part))
    height = circle.height(sheets.mapped(sheets.sky(looking)))
    lines = find_contours(np.concatenate([height, height[:1]]), 0.0)
    last = len(turn) - 1
    curves = []
    for line, closed in _joined([list(map(tuple, line)) for line in lines], last, sheet.index == 0):
        place = np.array(line)
        at_turn = np.interp(place[:, 0], np.arange(len(turn)), turn)
        at_part = np.interp(place[:, 1], np.arange(len(part)), part)
        looking = sky_lines.looking(sheets.camera, at_turn, sheet.depth(at_turn, at_part))
        curves.append((sheets.sky(looking), closed))
    return curves


def _joined(lines: list[list[tuple[float, float]]], last: int, has_pole: bool) -> list[tuple[list, bool]]:
    """Contours of a grid whose first row is its last, joined where they meet across it.

    has_pole: the first column is one point, and the two contours that run into it are one.
    """
    whole = [(line[:-1], True) for line in lines if line[0] == line[-1]]
    pending = [line for line in lines if line[0] != line[-1]]

    def name(end: tuple[float, float]) -> tuple:
        if end[0] in (0, last):
            return ("seam", round(end[1], 9))
        return ("pole",) if has_pole and end[1] == 0 else ("edge", *end)

    while pending:
        line = pending.pop()
        grown = True
        while grown and not _meets(name(line[0]), name(line[-1])):
            grown = False
            for i, other in enumerate(pending):
                for first in (line, line[::-1]):
                    for second in (other, other[::-1]):
                        if not grown and _meets(name(first[-1]), name(second[0])):
                            line, grown = first[: -1 if name(first[-1])[0] == "seam" else None] + second, True
                if grown:
                    pending.pop(i)
                    break
        closed = _meets(name(line[0]), name(line[-1]))
        # Across the seam both ends are one point.
        whole.append((line[:-1] if closed and name(line[0])[0] == "seam" else line, closed))
    return whole


def _meets(one: tuple, other: tuple) -> bool:
    return one == other and one[0] != "edge"


def _refined(sheets: Sheets, index: int, circle: Circle, guess: tuple[Array, bool]) -> CircleCurve | None:
    """A curve with its points put on the circle, by steps along the gradient of the height; None where none hold."""
    sky, closed = guess
    gaps = np.linalg.norm(np.diff(sky, axis=0, append=sky[:1] if closed else sky[-1:]), axis=1)
    reach = np.maximum(np.maximum(gaps, np.roll(gaps, 1)), 1e-12)
    for _ in range(_NEWTON_STEPS):
        beams = _beams(sheets, sky)
        height, steepest = circle.height(beams.direction), _steepest_ascent(circle, sky, beams)
        slope = np.linalg.norm(steepest, axis=1)
        if (np.abs(height) <= 4 * beams.error).all():
            break
        size = np.clip(-height / slope, -reach, reach)
        sky = _moved(sky, steepest * (size / slope)[:, None])
    beams = _beams(sheets, sky)
    height = circle.height(beams.direction)
    error = (beams.error + np.abs(height)) / np.linalg.norm(_steepest_ascent(circle, sky, beams), axis=1)
    good = (np.asarray(beams.index) == index) & (np.abs(height) <= 1e3 * beams.error)
    longitude = np.unwrap(circle.longitude(beams.direction[good]))
    apart = np.concatenate([[True], np.abs(np.diff(longitude)) > _CLOSEST])
    if np.count_nonzero(apart) < 2:
        return None
    sky, longitude = sky[good][apart], longitude[apart]
    ahead = slice(None, None, 1 if longitude[-1] > longitude[0] else -1)
    return CircleCurve(index, sky[ahead], longitude[ahead], closed, float(error[good].max()))


def _beams(sheets: Sheets, sky: Array) -> Beams:
    return trace_beams(sheets.camera, sky, "auto", _TOLERANCE, crossings=False, redshift=False)


def _steepest_ascent(circle: Circle, sky: Array, beams: Beams) -> Array:
    """Gradient (n, 3) of the height above a circle on the camera sky."""
    upward = np.stack([e @ circle.normal for e in polar_basis(beams.direction)], axis=-1)
    flat = np.einsum("nij,ni->nj", beams.jacobian, upward)
    e_1, e_2 = tangent_basis(sky)
    return flat[:, :1] * e_1 + flat[:, 1:] * e_2


def _moved(sky: Array, step: Array) -> Array:
    """Points (n, 3) of the sphere after short steps (n, 3)."""
    sky = sky + step
    return sky / np.linalg.norm(sky, axis=1, keepdims=True)


def _ended(sheets: Sheets, circle: Circle, curve: CircleCurve, bounds: list[Points | None]) -> CircleCurve:
    """The curve led on to the critical points where it ends."""
    known = [points for points in bounds if points is not None and len(points)]
    if curve.closed or not known:
        return curve
    ends = [np.concatenate([getattr(points, name) for points in known]) for name in ("looking", "direction")]
    ends_sky, ends_longitude = sheets.sky(ends[0]), circle.longitude(ends[1])
    sky, longitude = curve.sky, curve.longitude
    for _ in range(2):
        # Both ends, one after the other.
        sky, longitude = sky[::-1], longitude[::-1]
        ahead = np.sign(longitude[-1] - longitude[0])
        gap = (ends_longitude - longitude[-1] + math.pi) % (2 * math.pi) - math.pi
        fits = (gap * ahead > 0) & (np.abs(gap) < _LAST_STEP)
        if fits.any():
            distance = np.where(fits, np.linalg.norm(ends_sky - sky[-1], axis=1), np.inf)
            nearest = int(distance.argmin())
            sky = np.concatenate([sky, ends_sky[nearest : nearest + 1]])
            longitude = np.append(longitude, longitude[-1] + gap[nearest])
    return CircleCurve(curve.index, sky, longitude, False, curve.error)
