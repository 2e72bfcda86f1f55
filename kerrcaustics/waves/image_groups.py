"""The field of all images: groups of two neighbouring indices, each by its best method."""

from dataclasses import dataclass

import numpy as np

from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map.arguments import HIGHEST_INDEX
from kerrcaustics.shapes import Complex, Float
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.waves.continuation import (
    FARTHEST_CONTINUED,
    NEAR,
    ContinuedRing,
    continued_ring,
    distance_by_size,
)
from kerrcaustics.waves.dark_sides import nearest_is_hidden
from kerrcaustics.waves.group_methods import GroupField, ImageGroup
from kerrcaustics.waves.nearest_curve import FARTHEST, nearest_curve
from kerrcaustics.waves.ring_integral import NearestCurve
from kerrcaustics.waves.summed_images import omitted_amplitude, separate_error
from kerrcaustics.waves.wave_images import WaveImages
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class WaveField:
    """The field of all images, by frequency.

    value: the field.
    error: its error.
    method: that of its brightest part.
    passed: orders of the caustics at which the method is finite and needs no count of the images that meet there.
    """

    value: Complex[Array, " frequencies"]
    error: Float[Array, " frequencies"]
    method: Array
    passed: frozenset[int]


@dataclass(frozen=True, eq=False)
class _Groups:
    """Groups by order, from 1 on.

    waves: all images of the star.
    calm: those of a star beside it where it lies next to a caustic, for errors: next to a caustic amplitudes say
    nothing of how bright other images are.
    """

    groups: tuple[ImageGroup, ...]
    waves: WaveImages
    calm: WaveImages

    def field(self, first: int, omega: Float[Array, " frequencies"], method: str) -> WaveField:
        """The field in groups of every second order from the first on: 1, or 2, where images of index 0 are alone."""
        used = self.groups[first - 1 :: 2]
        parts = [group.best(omega, method) for group in used]
        if first == 2:
            parts.insert(0, _separate_images(self.waves[self.waves.index == 0], omega))
        error = sum((part.error for part in parts), np.zeros(len(omega)))
        # Neighbours that belong to two groups are summed.
        for group in self.groups[2 - first :: 2]:
            error = error + group.error_if_split(omega)
        last = max((group.order for group in used), default=0)
        brightest = np.argmax([np.abs(part.value) for part in parts], axis=0)
        return WaveField(
            np.sum([part.value for part in parts], axis=0),
            error + min(omitted_amplitude(self.waves, last), omitted_amplitude(self.calm, last)),
            np.array([parts[part].method[i] for i, part in enumerate(brightest.tolist())]),
            frozenset(
                group.order for group, part in zip(used, parts[first - 1 :], strict=True) if "images" not in part.method
            ),
        )


def wave_field(
    source: WaveSource, waves: WaveImages, max_index: int, omega: Float[Array, " frequencies"], method: str
) -> WaveField:
    """The field of groups from the indices 0 and 1 on, or from 1 and 2 on: at each frequency that with less error."""
    groups = _groups(source, waves, max_index, method)
    one, other = (groups.field(first, omega, method) for first in (1, 2))
    best = one.error <= other.error
    chosen = [field.passed for field, used in ((one, best.any()), (other, not best.all())) if used]
    return WaveField(
        np.where(best, one.value, other.value),
        np.minimum(one.error, other.error),
        np.where(best, one.method, other.method),
        frozenset.intersection(*chosen),
    )


def _groups(source: WaveSource, waves: WaveImages, max_index: int, method: str) -> _Groups:
    """The groups at critical curves up to one order beyond the highest index."""
    sheets = source.sheets(min(max_index + 1, HIGHEST_INDEX))
    continued: dict[int, ContinuedRing | None] = {}
    curves: dict[int, NearestCurve | None] = {}
    nearest: dict[int, NearestCurve | None] = {}
    away = [distance_by_size(sheets, curve.order, source.star) for curve in sheets.curves.curves]
    for order, part in enumerate(away, 1):
        beside = order <= max_index + 1
        # For folds and cusps the curve only tells which images belong to the ring.
        nearest[order] = _curve(source, sheets, order) if beside and method not in ("images", "ring") else None
        curves[order] = nearest[order] if method in ("auto", "line") else None
        without = method != "line" and not _is_summed(curves[order], sheets, order, source.star)
        if part < NEAR or (beside and part < FARTHEST_CONTINUED and without and method != "images"):
            continued[order] = continued_ring(source, sheets, order, min(max_index + 1, HIGHEST_INDEX))
    near = {order for order, part in enumerate(away, 1) if part < NEAR}
    calm = next((ring.nearest_images for order, ring in continued.items() if ring is not None and order in near), waves)
    groups = []
    for order in range(1, max_index + 2):
        curve, ring = nearest.get(order), waves.ring(order)
        on_curve = np.ones(len(ring), bool) if curve is None or curve.gap else curve.holds(ring.time)
        groups.append(
            ImageGroup(
                ring[on_curve],
                ring[~on_curve],
                calm.ring(order) if order in near else _fainter(ring[on_curve], calm.ring(order)),
                curves.get(order),
                order,
                sheets.curves.curves[order - 1].points if order in curves else None,
                source.star,
                source.nearness,
                order in near,
                continued.get(order),
            )
        )
    return _Groups(tuple(groups), waves, calm)


def _is_summed(curve: NearestCurve | None, sheets: Sheets, order: int, star: Float[Array, " 3"]) -> bool:
    """True if an integral passes the part of a caustic that is nearest to the star."""
    return curve is not None and not nearest_is_hidden(curve, sheets.curves.curves[order - 1].points, star)


def _fainter(one: WaveImages, other: WaveImages) -> WaveImages:
    """The images with smaller amplitudes."""
    return one if np.linalg.norm(one.amplitude) <= np.linalg.norm(other.amplitude) else other


def _curve(source: WaveSource, sheets: Sheets, order: int) -> NearestCurve | None:
    """The nearest curve of a ring, if it is smooth."""
    caustic = sheets.curves.curves[order - 1].points
    if lengths(caustic.direction - source.star).min() >= FARTHEST:
        return None
    curve = nearest_curve(source, sheets.curves, order)
    return curve if curve.is_smooth else None


def _separate_images(waves: WaveImages, omega: Float[Array, " frequencies"]) -> GroupField:
    """Images that belong to no pair."""
    return GroupField(waves.field(omega), separate_error(waves, omega), ("images",) * len(omega))
