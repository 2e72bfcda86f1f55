"""Images at any longitude of a circle, from the links of its level curve."""

import math

import numpy as np

from kerrcaustics.images.search import ImageSearch, SkyImages
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.level_curves.branches import Branches
from kerrcaustics.shapes import Bool, Float

Array = np.ndarray

_TURN = 2 * math.pi
# Newton steps from the interpolated place; a star so many errors from an event is taken to be on the caustic.
_FEW_STEPS, _ERRORS = 8, 4.0
# Images of one index that are closer than this on the sky (radians) may be one.
_SAME = 1e-9


def images_on(
    branches: Branches, phi: Float[Array, " moments"]
) -> tuple[Float[Array, " moments"], ImageSearch, Bool[Array, " moments"]]:
    """Longitudes within a turn, the images there, and whether these are all, each once, away from events."""
    events = branches.events
    phi = events.gap_low[0] + (phi - events.gap_low[0]) % _TURN
    images = _interpolated(branches, phi)
    expected = events.counts[np.searchsorted(events.gap_low, phi, side="right") - 1]
    counts = images.counts(expected.shape)
    away = np.abs((phi[:, None] - events.longitude + math.pi) % _TURN - math.pi)
    sure = (counts == expected).all(axis=1) & ~(away <= _ERRORS * events.error).any(axis=1)
    first, second = images[:-1], images[1:]
    twice = (second.star == first.star) & (second.index == first.index)
    twice &= np.linalg.norm(second.sky - first.sky, axis=1) < _SAME
    sure[second.star[twice]] = False
    apart = np.zeros_like(expected, bool)
    return phi, ImageSearch(images, counts, expected, apart, apart, branches.sheets.coarse), sure


def _interpolated(branches: Branches, phi: Float[Array, " moments"]) -> SkyImages:
    """Images on the links that span the longitudes, refined; star: number of the longitude."""
    links = branches.links
    low, high = links.longitude(links.p_0), links.longitude(links.p_1)
    spans = [np.nonzero((low <= a) & (a < high)) for a in (phi[:, None] - _TURN, phi[:, None], phi[:, None] + _TURN)]
    moment, link = (np.concatenate(part) for part in zip(*spans, strict=True))
    longitude = phi[moment] + np.repeat([-_TURN, 0, _TURN], [len(span[0]) for span in spans])
    chosen = links[link]
    part = (chosen.parameter(longitude) - chosen.p_0) / (chosen.p_1 - chosen.p_0)
    start = branches.chart.sky(branches.kinds(chosen), branches.link_cubics[link].points(part))
    sheets = branches.sheets
    place = branches.circle.place(longitude)
    which, sky, error = find_roots(sheets.camera, place, chosen.index, start, _FEW_STEPS, end=sheets.surface)
    images = SkyImages.arriving(moment[which], chosen.index[which], sky, error)
    return images[np.lexsort((sky[:, 0], images.index, images.star))]
