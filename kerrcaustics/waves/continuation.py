"""The images of a ring that meet at a caustic, continued from stars at which they are apart.

Next to a caustic images merge, or cease to be, and their amplitudes grow without limit. The parameters of their uniform
field are analytic in the place of the star: they are computed for a few stars in a row on the side where the images
are, and continued to the star by a polynomial.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev

from kerrcaustics.curves.critical_points import Points
from kerrcaustics.images.images import star_images
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.shapes import Complex, Float
from kerrcaustics.spacetime.sphere import lengths, moved, polar_angle
from kerrcaustics.waves.summed_images import delays_to_next, field_in_pairs, unresolved_part
from kerrcaustics.waves.uniform import cusp_field, cusp_parameters, fold_field, fold_parameters
from kerrcaustics.waves.wave_images import WaveImages, wave_images
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray

NEAR = 1e-3
"""Distance from a caustic, in units of its size, below which the images of a star itself are of no use."""
FARTHEST_CONTINUED = 0.1
"""The same up to which images are continued."""
# Distances of the stars in the row beyond the caustic, in units of that of the last: Chebyshev nodes.
_STARS = (1.35 + 0.65 * chebyshev.chebpts1(5)) / 2
# Least length of the row of stars, in units of the size of the caustic.
_LEAST_ROW_BY_SIZE = 0.02
# Least length of the row, in units of the distance of the star from the caustic.
_LEAST_ROW_BY_DISTANCE = 3.0
# Factors of the length, tried one after another.
_ROW_FACTORS = (1.0, 3.0, 9.0, 1 / 3, 1 / 9, 1 / 27)


@dataclass(frozen=True, eq=False)
class ContinuedRing:
    """A ring of images continued to a star: two or three of them as one field, and the others.

    In arrays of two rows the second one is the same from one star fewer.

    method: "fold" or "cusp".
    index: the Morse indices that the field needs: the lower one of a pair; of three those of the middle and the others.
    parameters: those of `fold_field` or `cusp_field`.
    rest: the others, those from fewer stars second.
    nearest_images: all images of the nearest star of the row.
    ring: those of the ring, in their order round the hole, beginning with the two or three.
    reach: distance of the last star of the row.
    """

    method: str
    index: tuple[int, ...]
    parameters: Float[Array, "2 parameters"]
    rest: tuple[WaveImages, WaveImages]
    nearest_images: WaveImages
    ring: WaveImages
    reach: float

    def field(
        self, omega: Float[Array, " frequencies"], relative_error: Float[Array, " frequencies"]
    ) -> tuple[Complex[Array, " frequencies"], Float[Array, " frequencies"]]:
        """The field and its error; relative_error: that of a uniform field."""
        (value, size), (fewer, _) = (self._uniform_field(omega, row) for row in self.parameters)
        one, other = (rest.field(omega) for rest in self.rest)
        meeting = self.ring[: _MEETING[self.method]]
        more, unsure = field_in_pairs(
            meeting.joined(self.rest[0]), np.arange(len(self.ring)) < len(meeting), omega, relative_error
        )
        in_doubt = relative_error + unresolved_part(self.ring, len(meeting), omega)
        error = in_doubt * np.maximum(size, np.abs(value)) + np.abs(value + one - fewer - other) + meeting.error(omega)
        return value + more, error + unsure

    def _uniform_field(
        self, omega: Float[Array, " frequencies"], parameters: Float[Array, " parameters"]
    ) -> tuple[Complex[Array, " frequencies"], Float[Array, " frequencies"]]:
        if self.method == "fold":
            return fold_field(omega, self.index[0], parameters)
        return cusp_field(omega, (self.index[0], self.index[1]), parameters)


_MEETING = {"fold": 2, "cusp": 3}


def meeting_images(ring: WaveImages, method: str) -> WaveImages:
    """The images of a ring, beginning with the two or three neighbours that are closest in time."""
    gap = delays_to_next(ring)
    first = int(gap.argmin()) if method == "fold" else int(np.maximum(gap, np.roll(gap, -1)).argmin())
    return ring[np.roll(np.arange(len(ring)), -first)]


def meeting_parameters(ring: WaveImages, method: str) -> tuple[tuple[int, ...], Float[Array, " parameters"]]:
    """Morse indices and parameters of the field of the first two or three images."""
    time, amplitude, index = ring.time, ring.amplitude, ring.index.tolist()
    if method == "fold":
        early = np.argsort(time[:2])
        return (min(index[:2]),), fold_parameters(time[:2][early], amplitude[:2][early])
    return (index[1], index[0]), cusp_parameters(index[1] - index[0], time[:3], amplitude[:3])


def distance_by_size(sheets: Sheets, order: int, star: Float[Array, " 3"]) -> float:
    """Distance of a star from the caustic of a critical curve, by its size; infinite for one that is a point."""
    polygon = sheets.polygons[order - 1]
    if polygon.curve.is_point:
        return math.inf
    return float(polygon.winding(star[None]).distance[0]) / _size(polygon.curve.points)


def continued_ring(source: WaveSource, sheets: Sheets, order: int, max_index: int) -> ContinuedRing | None:
    """The ring at a critical curve, continued to a star beside its caustic; None where no row of stars serves."""
    star, polygon = source.star, sheets.polygons[order - 1]
    nearest, size = float(polygon.winding(star[None]).distance[0]), _size(polygon.curve.points)
    # At a cusp the caustic turns: points beside the nearest one tell its direction.
    points = polygon.curve.points.joined(polygon.winding(_foot(polygon.curve.points, star)[None]).points)
    along = points.major[lengths(points.direction - star).argmin()]
    directions = np.array([along, -along, np.cross(star, along), -np.cross(star, along)])
    directions -= (directions @ star)[:, None] * star
    directions /= lengths(directions)[:, None]
    for length in _ROW_FACTORS:
        steps = nearest + length * max(_LEAST_ROW_BY_SIZE * size, _LEAST_ROW_BY_DISTANCE * nearest) * _STARS
        places = np.array([moved(np.tile(star, (len(steps), 1)), steps[:, None] * way) for way in directions])
        method, way = _method_and_row(sheets, order, places)
        ring = _continued(source, order, max_index, method, places[way]) if method else None
        if ring is not None:
            return ring
    return None


def _foot(points: Points, star: Float[Array, " 3"]) -> Float[Array, " 3"]:
    """The place on the sides between points of a caustic that is nearest to a star."""
    side = np.roll(points.direction, -1, axis=0) - points.direction
    away = star - points.direction
    part = np.clip((side * away).sum(axis=1) / np.maximum((side * side).sum(axis=1), np.finfo(float).tiny), 0, 1)
    places = points.direction + part[:, None] * side
    foot = places[lengths(places - star).argmin()]
    return foot / np.linalg.norm(foot)


def _size(points: Points) -> float:
    """The distance of the farthest point of a caustic from its middle."""
    return float(lengths(points.direction - points.direction.mean(axis=0)).max())


def _method_and_row(sheets: Sheets, order: int, places: Float[Array, "4 stars 3"]) -> tuple[str, int]:
    """The method, and the row with two more images than others; an empty word if there is none.

    places: stars in rows along the caustic and across it, to both sides of each. Beside a fold the rows across differ,
    beside a cusp the row along that lies within it has more images than those across.
    """
    counted = sheets.expected_counts(places.reshape(-1, 3))
    count = counted.expected[:, order - 1 : order + 1].reshape(4, places.shape[1], -1)
    steady = (count == count[:, :1]).all(axis=(1, 2)) & ~counted.on_caustic[:, order - 1].reshape(4, -1).any(axis=1)
    number = count[:, 0].sum(axis=1)
    more = 2 if count.shape[-1] == 2 else 1
    if steady[2:].all() and abs(number[2] - number[3]) == more:
        return "fold", 2 if number[2] > number[3] else 3
    inside = [way for way in (0, 1) if steady[way] and steady[2:].all() and (number[way] > number[2:]).all()]
    return ("cusp", inside[0]) if inside else ("", 0)


def _continued(
    source: WaveSource, order: int, max_index: int, method: str, places: Float[Array, "stars 3"]
) -> ContinuedRing | None:
    """The ring continued from a row of stars; None where these do not see the same images."""
    theta, phi = polar_angle(places), np.arctan2(places[:, 1], places[:, 0])
    beside = []
    for place in zip(theta.tolist(), phi.tolist(), strict=True):
        moved_source = replace(source, place=place)
        images = star_images(moved_source.viewer, place, max_index, end=moved_source.surface)
        if any(images.per_index[k] != images.expected[k] for k in (order - 1, order) if k <= max_index):
            return None
        beside.append(wave_images(moved_source, images))
    if len(beside[0].ring(order)) < _MEETING[method]:
        return None
    rings = [meeting_images(waves.ring(order), method) for waves in beside]
    alike = all(ring.index.tolist() == rings[0].index.tolist() for ring in rings)
    if not alike or not np.isfinite(delays_to_next(rings[0])[: _MEETING[method] - 1]).all():
        return None
    found = [meeting_parameters(ring, method) for ring in rings]
    away = lengths(places - source.star)
    weights = np.array([_weights(away), np.append(_weights(away[:-1]), 0.0)])
    parameters = weights @ np.array([values for _, values in found])
    if not np.isfinite(parameters).all():
        return None
    rest = [ring[_MEETING[method] :] for ring in rings]
    rows = [_weighted(rest, row) for row in weights]
    return ContinuedRing(method, found[0][0], parameters, (rows[0], rows[1]), beside[0], rings[0], float(away[-1]))


def _weights(away: Float[Array, " stars"]) -> Float[Array, " stars"]:
    """Weights of values at some distances in the polynomial's value at distance 0."""
    apart = away[:, None] - away + np.eye(len(away))
    return (np.where(np.eye(len(away), dtype=bool), 1.0, -away / apart)).prod(axis=1)


def _weighted(rings: Sequence[WaveImages], weights: Float[Array, " stars"]) -> WaveImages:
    """Images whose times and amplitudes are weighted sums of those of others."""
    time, amplitude = (weights @ np.array([getattr(ring, name) for ring in rings]) for name in ("time", "amplitude"))
    return replace(rings[0], time=time, amplitude=amplitude)
