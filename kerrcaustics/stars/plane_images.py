"""Images of sources in the equatorial plane, at one crossing of it: what users keep."""

import math

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import elementwise

from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.curves.circle_arcs import Arcs, arcs_of
from kerrcaustics.curves.circles_in_plane import TOLERANCE
from kerrcaustics.curves.lens_map import LensMap
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import apart, numbers, quoted
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_TURN = 2 * math.pi
# A source so many errors from where the azimuth turns back cannot be told from a caustic.
_ERRORS = 10.0


@result(
    "plane-images/1",
    record="crossing radius phi max_index certified per_index on_caustic remarks",
    rows="sky azimuth index parity magnification redshift time time_error error",
)
class PlaneImages:
    """The images of one source in the equatorial plane by rays that cross it there for the n-th time."""

    crossing: int = quantity("", "1", "which crossing of the plane, from 1")
    radius: float = quantity("", "GM/c^2", "of the source")
    phi: float = quantity("", "rad", "azimuth of the source", given=True)
    sky: Array = quantity("image axis", "1", "directions N on the camera sky; of an Observer (alpha, beta)")
    azimuth: Array = quantity("image", "rad", "unwrapped phi of the ray: phi plus whole turns", json="azimuth_deg")
    index: Array = quantity("image", "1", "Morse index")
    parity: Array = quantity("image", "1", "(-1)^index")
    magnification: Array = quantity(
        "image",
        "c^4/(GM)^2",
        "solid angle on the sky by area r dr dphi in the plane: 1 / |det J|; of an Observer (GM/c^2)^2 by that area",
    )
    redshift: Array = quantity("image", "1", "nu_camera / nu_source, for the plane's emitter")
    time: Array = quantity("image", "GM/c^3", "coordinate time from the source to the camera")
    time_error: Array = quantity("image", "GM/c^3", "estimated error of time")
    error: Array = quantity("image", "rad", "error of sky; of an Observer in GM/c^2", json="error_rad")
    per_index: dict[int, int] = quantity("morse_index", "1", "how many images of each index were found")
    on_caustic: bool = quantity("", "1", "True where the source cannot be told from a caustic")
    certified: bool = quantity(
        "",
        "1",
        "True where the image of the source's circle is whole, its azimuth runs on each part of it as the index there "
        "says, once round in all, and the source lies on no caustic",
    )
    remarks: tuple[str, ...] = quantity("", "", "what is not certain; empty when certified", default=())

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index that was asked for."""
        return max(self.per_index)

    def __len__(self) -> int:
        """Number of images."""
        return len(self.index)

    def __repr__(self) -> str:
        """One line: the source, how many images, whether certified."""
        counts = ", ".join(f"{count} of index {k}" for k, count in self.per_index.items() if count)
        where = f"r = {self.radius:.9g}, phi = {self.phi:.9g}, crossing {self.crossing}"
        return f"<PlaneImages of a source at {where}: {counts or 'none'}{'' if self.certified else ', not certified'}>"


def plane_images(camera: Viewer, source: object, max_index: int, end: EquatorialPlane) -> PlaneImages:
    """All images of a source (r, phi) with Morse index 0 to max_index, by rays at their n-th crossing."""
    radius, phi = checked_source(camera, "star", source)
    arcs = arcs_of(camera, end.crossing, radius)
    edge_phase, index = _seen(arcs, phi)
    kept = index <= max_index
    edge_phase, index = edge_phase[kept], index[kept]
    found = arcs.at(edge_phase) if len(edge_phase) else arcs.low[:0]
    order = np.lexsort((edge_phase, index))
    found, index = found[order], index[order]
    lens_map = LensMap(camera, end)
    at = lens_map.seen(found.sky)
    miss = np.hypot(np.log(found.radius / radius), _away(found.azimuth, phi))
    near = _near_fold(arcs, phi)
    off = radius * (found.error + miss) / np.where(found.minor == 0, 1, found.minor)
    remarks = list(arcs.doubts)
    if near:
        remarks.append("the source cannot be told from a caustic: it may have two images more, or less")
    return PlaneImages(
        crossing=end.crossing,
        radius=radius,
        phi=phi,
        sky=at.sky,
        azimuth=at.beams.azimuth,
        index=index,
        parity=1 - 2 * (index % 2),
        magnification=at.magnification,
        redshift=at.redshift,
        time=np.asarray(at.time),
        time_error=np.asarray(at.time_error),
        error=lens_map.errors(found.sky, off),
        per_index={k: int((index == k).sum()) for k in range(max_index + 1)},
        on_caustic=near,
        certified=not remarks,
        remarks=tuple(remarks),
    )


@result("plane-counts/1", record="crossing max_index all_certified", rows="sources counts on_caustic certified")
class PlaneCounts:
    """Image counts of many sources in the equatorial plane, at one crossing."""

    sources: Array = quantity("source place_axis", "1", "r in GM/c^2, phi in radians")
    crossing: int = quantity("", "1", "which crossing of the plane, from 1")
    counts: Array = quantity("source morse_index", "1", "images, by Morse index", json="per_index")
    on_caustic: Array = quantity("source", "1", "True where the source cannot be told from a caustic")
    certified: Array = quantity("source", "1", "True as in `PlaneImages`")

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index that was asked for."""
        return self.counts.shape[1] - 1

    @property
    @derived("", "1", json="certified")
    def all_certified(self) -> bool:
        """Whether every source is certified."""
        return bool(self.certified.all())


def plane_counts(camera: Viewer, sources: object, max_index: int, end: EquatorialPlane) -> PlaneCounts:
    """Counts of the images of sources (n, 2) = (r, phi): quick for many on one circle."""
    places = numbers("stars", sources)
    if places.ndim != 2 or places.shape[-1] != 2 or not np.isfinite(places).all():
        raise ValueError("Argument `stars` must be an array of finite numbers of shape (n, 2): r, phi.")
    counts = np.zeros((len(places), max_index + 1), int)
    near, certified = np.zeros((2, len(places)), bool)
    for radius in np.unique(places[:, 0]).tolist():
        checked_source(camera, "stars", (radius, 0.0))
        arcs = arcs_of(camera, end.crossing, radius)
        for i in np.flatnonzero(places[:, 0] == radius).tolist():
            holds = _holding(arcs, places[i, 1])
            counts[i] = np.bincount(arcs.index[holds], minlength=max_index + 1)[: max_index + 1]
            near[i] = _near_fold(arcs, places[i, 1])
            certified[i] = not (arcs.doubts or near[i])
    return PlaneCounts(places, end.crossing, counts, near, certified)


def _near_fold(arcs: Arcs, phi: float) -> bool:
    close = np.abs(_away(arcs.folds.azimuth, phi)) <= _ERRORS * (arcs.folds.error + TOLERANCE)
    return bool(close.any())


def checked_source(camera: Viewer, name: str, source: object) -> tuple[float, float]:
    """A place (r, phi) in the plane that the user gave as the argument `name`."""
    place = numbers(name, source)
    if place.shape != (2,) or not np.isfinite(place).all():
        raise ValueError(
            f"Argument `{name}` must be two finite numbers (r, phi), phi in radians, but is {quoted(source)}."
        )
    radius, phi = place.tolist()
    horizon = kerr.horizon(camera.spin)
    if not radius > horizon:
        given, least = apart(radius, horizon)
        raise ValueError(f"Argument `{name}` must have an r larger than the horizon's {least}, but is {given}.")
    return radius, phi


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
