"""Images of sources in the equatorial plane, at one crossing: those on the arcs of the source's circle."""

import math

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import elementwise

from kerrcaustics.images.circle_arcs import Arcs, arcs_of
from kerrcaustics.images.search import ImageSearch, SkyImages, searched_together
from kerrcaustics.lens_map.domains import Ring
from kerrcaustics.lens_map.search_sky import TOLERANCE

Array = np.ndarray

_TURN = 2 * math.pi
# A source so many errors from where the azimuth turns back cannot be distinguished from a caustic.
_ERRORS = 10.0


def searched(domain: Ring, places: Float[Array, "sources 2"], max_index: int) -> ImageSearch:
    """All images of sources (r, phi), by rays at their n-th crossing."""
    return searched_together([_one(domain, radius, phi, max_index) for radius, phi in places.tolist()])


def _one(domain: Ring, radius: float, phi: float, max_index: int) -> ImageSearch:
    arcs = arcs_of(domain, radius)
    edge_phase, index = _seen(arcs, phi)
    kept = index <= max_index
    edge_phase, index = edge_phase[kept], index[kept]
    found = arcs.at(edge_phase) if len(edge_phase) else arcs.low[:0]
    order = np.lexsort((edge_phase, index))
    found, index = found[order], index[order]
    miss = np.hypot(np.log(found.radius / radius), _away(found.azimuth, phi))
    counts = np.bincount(index, minlength=max_index + 1)[None]
    error = radius * (found.error + miss) / np.where(found.minor == 0, 1, found.minor)
    return ImageSearch(
        images=SkyImages.arriving(np.zeros(len(index), int), index, found.sky, error),
        counts=counts,
        expected=counts,
        on_caustic=_touched(arcs, phi, max_index)[None],
        ring=np.zeros((1, max_index + 1), bool),
        coarse=(0.0,) * (max_index + 1),
        remarks=(arcs.remarks,),
        certificate="arcs",
    )


def counted(
    domain: Ring, places: Float[Array, "sources 2"], max_index: int
) -> tuple[Int[Array, "sources indices"], Bool[Array, " sources"], Bool[Array, " sources"]]:
    """Counts of the images of sources, which lie on a caustic, which are certified: quick for many on one circle."""
    counts = np.zeros((len(places), max_index + 1), int)
    near, certified = np.zeros((2, len(places)), bool)
    for radius in np.unique(places[:, 0]).tolist():
        arcs = arcs_of(domain, radius)
        for i in np.flatnonzero(places[:, 0] == radius).tolist():
            holds = _holding(arcs, places[i, 1])
            counts[i] = np.bincount(arcs.index[holds], minlength=max_index + 1)[: max_index + 1]
            near[i] = _touched(arcs, places[i, 1], max_index).any()
            certified[i] = not (arcs.remarks or near[i])
    return counts, near, certified


def _touched(arcs: Arcs, phi: float, max_index: int) -> Bool[Array, " orders"]:
    """By order, to max_index + 1, whether a source cannot be distinguished from that caustic."""
    which = np.flatnonzero(arcs.index != np.roll(arcs.index, 1))
    folds = arcs.low[which]
    close = np.abs(_away(folds.azimuth, phi)) <= _ERRORS * (folds.error + TOLERANCE)
    orders = np.maximum(arcs.index, np.roll(arcs.index, 1))[which][close]
    return np.isin(np.arange(1, max_index + 2), orders)


def _away(azimuth: Float[Array, "*n"], phi: float) -> Float[Array, "*n"]:
    return (azimuth - phi + math.pi) % _TURN - math.pi


def _holding(arcs: Arcs, phi: float) -> Bool[Array, " arcs"]:
    """True for the arcs on which a source is seen; at a common end of two, for one of them."""
    start = _away(arcs.low.azimuth, phi)
    step = (arcs.high.azimuth - arcs.low.azimuth + math.pi) % _TURN - math.pi
    end = _away(arcs.high.azimuth, phi)
    # Steps are short: where both ends lie on both sides of the source's opposite, it is not between them.
    return ((start > 0) != (end > 0)) & (np.abs(end - start - step) < 1)


def _seen(arcs: Arcs, phi: float) -> tuple[Float[Array, " images"], Int[Array, " images"]]:
    """Turn and index at which a source is seen on the circle."""
    holds = _holding(arcs, phi)
    low, index = arcs.low.edge_phase[holds], arcs.index[holds]
    if not holds.any():
        return low, index

    def miss(step: Array, low: Array) -> Array:
        return _away(arcs.at((low + step) % _TURN).azimuth, phi)

    bracket = np.zeros(len(low)), (arcs.high.edge_phase[holds] - low) % _TURN
    root = elementwise.find_root(miss, bracket, args=(low,), tolerances={"xatol": 1e-15, "xrtol": 1e-14})
    step = np.where(np.isfinite(root.x), root.x, bracket[1] / 2)
    return (low + step) % _TURN, index
