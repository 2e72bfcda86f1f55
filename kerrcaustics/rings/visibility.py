"""Visibilities of photon rings on the baselines of an interferometer.

Of a uniform band they are line integrals along its edges, of a band with a profile sums over rays between them
(ring_light.py). The number of nodes follows from the baseline and the size of the ring, so that no pixel is needed.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.interop.physical_scale import PhysicalScale
from kerrcaustics.interop.row_tables import BaselineTable
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.rings.band_edge import BandEdge, EdgeNodes, edge_nodes
from kerrcaustics.rings.results import PhotonBand, PhotonRings, both_edges
from kerrcaustics.rings.ring_light import LightNodes, light_nodes
from kerrcaustics.shapes import Complex, Float
from kerrcaustics.spacetime.checks import instance_of, numbers, one_of, whole_number
from kerrcaustics.spacetime.observer import Observer
from kerrcaustics.spacetime.viewer import Viewer, finite_number

Array = np.ndarray

Brightness = Callable[[Array, Array, Array], Array]

# Nodes by the phase across the ring: N = 2 (1.2 k R (1 + kappa) + 40), where half as many are enough.
_PER_PHASE, _AT_LEAST = 1.2, 40
# The ratio from one number of nodes to the next one that is used.
_LADDER = math.sqrt(2)
# Largest number of nodes along an edge, and of rays for a profile.
_MOST_NODES, _MOST_RAYS = 200_000, 4_000_000
# Largest number of phases that are held at once.
_AT_ONCE = 2_000_000
# Phase across the ring below which the line integral is a power series, and its terms.
_SMALL, _TERMS = 0.3, 14
# Rounding of a sum of phases, relative.
_ROUNDING = 4e-16
_GIGA = 1e9


@result(
    "visibilities/1",
    record="order unit position_angle certified remarks flux flux_error",
    points="u v real imaginary error",
)
class Visibilities(BaselineTable):
    """Visibilities of the bands of photon rings, order by order: the Fourier transform of their light.

    V = integral of I exp(-2 pi i (u l + v m)) over the sky, l to the east and m to the north.
    """

    camera: Viewer = declared.viewer(json=None)
    order: Array = quantity("order", "1", "order n of each band")
    u: Array = quantity("baseline", "1", "baseline to the east, in unit")
    v: Array = quantity("baseline", "1", "baseline to the north, in unit")
    unit: str = quantity("", "", 'unit of baselines: "1/M", or "giga-wavelengths" with a scale')
    position_angle: float = quantity("", "rad", "position angle of the spin axis, east of north", given=True)
    real: Array = quantity("order baseline", "(GM/c^2)^2", "real part, times the unit of the brightness")
    imaginary: Array = quantity("order baseline", "(GM/c^2)^2", "imaginary part, times the unit of the brightness")
    error: Array = quantity("order baseline", "(GM/c^2)^2", "estimated error, times the unit of the brightness")
    flux: Array = quantity("order", "(GM/c^2)^2", "visibility of no baseline, times the unit of the brightness")
    flux_error: Array = quantity("order", "(GM/c^2)^2", "estimated error of flux")
    certified: bool = declared.certified("True if the bands are certified")
    remarks: tuple[str, ...] = declared.remarks()

    @property
    def value(self) -> Complex[Array, "orders baselines"]:
        """The visibilities, complex, of each order (order, baseline)."""
        return self.real + 1j * self.imaginary

    def __repr__(self) -> str:
        """Summary in one line."""
        return f"<Visibilities of orders {', '.join(map(str, self.order.tolist()))}, on {len(self.u)} baselines>"


@usual_warnings
def ring_visibility(
    rings: PhotonRings,
    u: ArrayLike,
    v: ArrayLike,
    *,
    order: int | None = None,
    brightness: Brightness | None = None,
    motion: str | None = None,
    scale: PhysicalScale | None = None,
    position_angle: float = 0.0,
) -> Visibilities:
    """Visibilities of photon rings, uniformly bright or with a brightness of the matter.

    Parameters
    ----------
    rings : PhotonRings
        Bands of an Observer, from `photon_rings`.
    u, v : array or float
        Baselines to the east and to the north: per M, or with a scale in giga-wavelengths. They are broadcast.
    order : int, optional
        The order of the band; if omitted, all bands with two edges.
    brightness : function, optional
        Intensity as the observer sees it, a function of arrays of the radius and azimuth at which light leaves the
        matter and of its frequency ratio. If omitted, 1 within the bands.
    motion : str, optional
        Motion of the matter, for the frequency ratio of a brightness; an emitter of `EquatorialPlane`, by default
        "plunging".
    scale : PhysicalScale, optional
        Mass and distance of the hole.
    position_angle : float
        Angle of the projected spin axis on the sky, from north to east, radians.

    Returns
    -------
    Visibilities

    Raises
    ------
    ValueError
        If an argument is invalid, or a baseline is so long that it needs too many nodes or rays.

    Errors
    ------
    `Visibilities.error`: the difference between all nodes and half of them, of profiles also that between the rules of
    15 and of 7 nodes across the band, the error of the edges, and rounding.

    Notes
    -----
    Up to the number of nodes that a baseline needs the sum is worthless, beyond it converges at once; twice that
    number is used. Light of all orders adds up: the matter is transparent.

    References
    ----------
    Johnson et al. 2020, arXiv:1907.04329, for rings on long baselines; Gralla 2020, arXiv:2005.03856.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> rings = kc.photon_rings(kc.Observer(spin=0.94, inclination=0.3))
    >>> seen = kc.ring_visibility(rings, [0.0, 1.0], 0.0, order=1)
    >>> bool(abs(seen.value[0, 0] - rings[1].solid_angle) < 1e-10), bool(seen.error.max() < 1e-10)
    (True, True)
    """
    instance_of("rings", rings, PhotonRings)
    if not isinstance(rings.camera, Observer):
        raise ValueError(
            "Argument `rings` must be those of an Observer, whose sky is a plane, but its viewer is a Camera."
        )
    if brightness is not None and not callable(brightness):
        raise ValueError("Argument `brightness` must be a function of radius, azimuth and frequency ratio, or None.")
    if motion is not None and brightness is None:
        raise ValueError("Argument `motion` must be left out without a brightness, as nothing else depends on it.")
    emitter = "plunging" if motion is None else motion
    one_of("motion", emitter, EMITTERS)
    east, north, unit = _baselines(u, v, scale)
    turn = finite_number("position_angle", position_angle)
    bands = _bands_of_order(rings, order)
    # Alpha points to the west where the spin axis points north.
    turned = np.stack(
        [-east * math.cos(turn) + north * math.sin(turn), east * math.sin(turn) + north * math.cos(turn)], axis=-1
    )
    # The last one is the visibility of no baseline.
    waves = np.concatenate([2 * math.pi * _per_mass(scale) * turned, np.zeros((1, 2))])
    sums = [
        uniform_visibility(band, waves) if brightness is None else _of_light(rings, band, waves, brightness, emitter)
        for band in bands
    ]
    value, error = (np.stack(parts) for parts in zip(*sums, strict=True))
    return Visibilities(
        camera=rings.camera,
        order=np.array([band.order for band in bands]),
        u=east,
        v=north,
        unit=unit,
        position_angle=turn,
        real=np.real(value)[:, :-1],
        imaginary=np.imag(value)[:, :-1],
        error=error[:, :-1],
        flux=np.real(value)[:, -1],
        flux_error=error[:, -1],
        certified=all(band.certified for band in bands),
        remarks=tuple(f"order {band.order}: {text}" for band in bands for text in band.remarks),
    )


def _baselines(u: ArrayLike, v: ArrayLike, scale: PhysicalScale | None) -> tuple[Array, Array, str]:
    """The baselines as arrays of one length, and their unit."""
    if scale is not None:
        instance_of("scale", scale, PhysicalScale)
    given = numbers("u", u), numbers("v", v)
    try:
        east, north = (part.ravel().copy() for part in np.broadcast_arrays(*given))
    except ValueError:
        raise ValueError(
            f"Argument `v` must have the shape of `u`, {given[0].shape}, or one that goes with it, but has "
            f"{given[1].shape}."
        ) from None
    for name, values in (("u", east), ("v", north)):
        if not np.isfinite(values).all():
            raise ValueError(f"Argument `{name}` must hold finite numbers.")
    return east, north, "1/M" if scale is None else "giga-wavelengths"


def _per_mass(scale: PhysicalScale | None) -> float:
    """Cycles per M of a baseline of 1."""
    return 1.0 if scale is None else _GIGA * math.radians(scale.microarcseconds / 3.6e9)


def _bands_of_order(rings: PhotonRings, order: int | None) -> list[PhotonBand]:
    """The bands of an argument; ValueError if there are none with two edges."""
    if order is None:
        bands = [band for band in rings if band.outer is not None]
    else:
        bands = [rings[whole_number("order", order, 0, len(rings) - 1)]]
    both_edges(bands[0] if bands else rings[0])
    return bands


def nodes_needed(wave: Float[Array, " n"], radius: float, bend: float) -> Float[Array, " n"]:
    """Twice the number of nodes along an edge from which on sums converge, on a ladder."""
    least = 2 * (_PER_PHASE * wave * radius * (1 + bend) + _AT_LEAST)
    count = _AT_LEAST * _LADDER ** np.ceil(np.log(least / _AT_LEAST) / math.log(_LADDER))
    return 4 * np.ceil(count / 4)


def uniform_visibility(band: PhotonBand, waves: Float[Array, "n 2"]) -> tuple[Complex[Array, " n"], Float[Array, " n"]]:
    """Visibilities of a uniform band on wave vectors, per M, and their errors."""
    inner, outer = both_edges(band)
    (hole, hole_error), (whole, whole_error) = (_enclosed(edge, waves) for edge in (inner, outer))
    value, error = whole - hole, whole_error + hole_error
    # Without a baseline the area between the edges is known better than that within each.
    still = (waves == 0).all(axis=1)
    return np.where(still, band.solid_angle, value), np.where(still, band.solid_angle_error, error)


def _enclosed(edge: BandEdge, waves: Float[Array, "n 2"]) -> tuple[Complex[Array, " n"], Float[Array, " n"]]:
    """Visibilities of the region within an edge, and errors."""
    size = np.hypot(*waves.T)
    centre = (edge.sky.max(axis=0) + edge.sky.min(axis=0)) / 2
    radius = float(np.hypot(*(edge.sky - centre).T).max())
    needed = nodes_needed(size, radius, 1 - abs(edge.camera.cos_theta))
    _check_count(needed, _MOST_NODES, "nodes along an edge", size)
    value, error = np.empty(len(size), complex), np.empty(len(size))
    for count in np.unique(needed):
        rows = np.flatnonzero(needed == count)
        fine = _centred(edge_nodes(edge, int(count)), centre)
        coarse = _centred(edge_nodes(edge, int(count) // 2), centre) if edge.camera.on_equator else None
        long = np.linalg.norm(fine.step, axis=1).sum()
        for part in np.array_split(rows, max(1, -(-len(rows) * len(fine.place) // _AT_ONCE))):
            value[part], half = _line_integrals(fine, coarse, waves[part], radius)
            error[part] = np.abs(value[part] - half) + long * (edge.error.max() + _ROUNDING * radius)
    return value * np.exp(-1j * (waves @ centre)), error


def _centred(nodes: EdgeNodes, centre: Float[Array, " 2"]) -> EdgeNodes:
    return EdgeNodes(nodes.place - centre, nodes.step)


def _line_integrals(
    fine: EdgeNodes, coarse: EdgeNodes | None, waves: Float[Array, "n 2"], radius: float
) -> tuple[Complex[Array, " n"], Complex[Array, " n"]]:
    """Visibilities of the region within a curve that runs clockwise, with all nodes, and with half of them."""
    terms = _terms(fine, waves, radius)
    half = 2 * terms[:, ::2].sum(axis=1) if coarse is None else _terms(coarse, waves, radius).sum(axis=1)
    return terms.sum(axis=1), half


def _terms(nodes: EdgeNodes, waves: Float[Array, "n 2"], radius: float) -> Complex[Array, "n nodes"]:
    """Terms of the line integrals: (1 / i k^2) (k x step) exp(-i k place), or a series where the phase is small."""
    square = (waves**2).sum(axis=1)
    near = square * radius**2 < _SMALL**2
    phase = waves @ nodes.place.T
    terms = np.empty(phase.shape, complex)
    across = waves[~near] @ np.stack([nodes.step[:, 1], -nodes.step[:, 0]])
    terms[~near] = -(np.sin(phase[~near]) + 1j * np.cos(phase[~near])) * (across / square[~near, None])
    # Integral of t exp(-i t s) from 0 to 1, over s.
    series = sum((-1j * phase[near]) ** m / (math.factorial(m) * (m + 2)) for m in range(_TERMS))
    (x, y), (dx, dy) = nodes.place.T, nodes.step.T
    terms[near] = series * (y * dx - x * dy)
    return terms


def _of_light(
    rings: PhotonRings, band: PhotonBand, waves: Float[Array, "n 2"], brightness: Brightness, motion: str
) -> tuple[Complex[Array, " n"], Float[Array, " n"]]:
    """Visibilities of a band with a profile, and errors."""
    inner, outer = both_edges(band)
    size = np.hypot(*waves.T)
    radius = float(np.hypot(*outer.sky.T).max())
    count = nodes_needed(size.max(keepdims=True), radius, 1 - abs(inner.camera.cos_theta))
    _check_count(count, _MOST_NODES, "lines across a band", size)
    light = light_nodes(inner, outer, int(count[0]), brightness, motion, _MOST_RAYS)
    value, error = np.empty(len(size), complex), np.empty(len(size))
    for part in np.array_split(np.arange(len(size)), max(1, -(-len(size) * light.place[..., 0].size // _AT_ONCE))):
        value[part], error[part] = _sums(light, waves[part])
    return value, error + light.error


def _sums(light: LightNodes, waves: Float[Array, "n 2"]) -> tuple[Complex[Array, " n"], Float[Array, " n"]]:
    """Sums over rays, and the differences to those over half of the lines and by the lower rule across the band."""
    phase = waves @ light.place.reshape(-1, 2).T
    turned = np.cos(phase) - 1j * np.sin(phase)
    half = np.zeros_like(light.weight)
    half[::2] = 2 * light.weight[::2]
    every, coarse, lower = (turned @ part.ravel() for part in (light.weight, half, light.lower_weight))
    size = np.abs(light.weight).sum()
    return every, np.abs(every - coarse) + np.abs(every - lower) + 2 * _ROUNDING * size


def _check_count(needed: Float[Array, " n"], most: int, what: str, size: Float[Array, " n"]) -> None:
    """Raise ValueError if a baseline needs too many nodes."""
    if needed.max() > most:
        longest = size.max() / (2 * math.pi)
        raise ValueError(
            f"Argument `u` must make shorter baselines: one of {longest:.4g} cycles per M needs {needed.max():.3g} "
            f"{what}, and {most} is the limit."
        )
