"""The light around a caustic at one frequency: fringes of folds, patterns of cusps and of whole small caustics.

The integrand of a ring of images is smooth in the place of the star: it is found for few stars, and interpolated.
"""

import itertools
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.extended_sources.arcs.boundary_arcs import values_at
from kerrcaustics.images.images import star_images
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map.arguments import HIGHEST_INDEX
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, in_steps, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Complex, Float
from kerrcaustics.spacetime.checks import argument_named, numbers, quoted, real_number, whole_number
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.spacetime.viewer import Viewer, check_viewer
from kerrcaustics.waves.amplification import LARGEST_FREQUENCY, LEAST_FREQUENCY
from kerrcaustics.waves.dark_sides import error_beyond_gap
from kerrcaustics.waves.group_methods import ring_error
from kerrcaustics.waves.nearest_curve import curves_with_gap, nearest_curve
from kerrcaustics.waves.ring_integral import NearestCurve, resampled
from kerrcaustics.waves.summed_images import image_sum_error, omitted_amplitude, ring_sum_error
from kerrcaustics.waves.wave_images import WaveImages, wave_images
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray

# Stars on each side, from which others are interpolated, and stars between these that measure the error.
_STARS = 7
_GRID, _NODES = chebyshev.chebpts1(_STARS), _STARS**2
_BETWEEN = [(0.31, -0.57), (-0.73, 0.12), (0.08, 0.83)]
# Most rows and columns.
_MOST_PIXELS = 2000
# Most entries that are held at once.
_MOST_ENTRIES = 4_000_000


@result(
    "diffraction-pattern/1",
    record="camera surface frequency max_index orders remarks theta phi",
    points="real imaginary error",
)
class DiffractionPattern(Shown):
    """The field at the viewer, for sources all over a part of the celestial sphere, at one frequency."""

    camera: Viewer = declared.viewer()
    surface: End = declared.surface()
    frequency: float = quantity("", "c^3/GM", "angular frequency at infinity, times the mass")
    max_index: int = declared.highest_index()
    orders: tuple[int, ...] = quantity("", "1", "orders of the critical curves whose images contribute")
    theta: Array = quantity("row", "rad", "theta' of the sources")
    phi: Array = quantity("column", "rad", "phi' of the sources")
    real: Array = quantity("row column", "1", "real part of the field; of an Observer at infinity in GM/c^2")
    imaginary: Array = quantity("row column", "1", "imaginary part")
    error: Array = quantity("row column", "1", "estimated error of the field")
    remarks: tuple[str, ...] = declared.remarks("remarks on what is left out")

    @property
    def value(self) -> Complex[Array, "rows columns"]:
        """The field (rows, columns), complex."""
        return self.real + 1j * self.imaginary

    def __repr__(self) -> str:
        """Summary in one line: how many sources, and the frequency."""
        rows, columns = self.real.shape
        return f"<DiffractionPattern of {rows} x {columns} sources at the frequency {self.frequency:g}>"


@usual_warnings
@argument_named("camera", "viewer")
@with_progress
def diffraction_pattern(
    viewer: Viewer,
    region: ArrayLike,
    frequency: float,
    *,
    max_index: int = 2,
    pixels: int = 200,
    progress: Progress | bool | None = None,
) -> DiffractionPattern:
    """The field of sources around a caustic, as `amplification` gives it for one source.

    Parameters
    ----------
    viewer : Camera or Observer
    region : ((theta', theta'), (phi', phi'))
        The part of the celestial sphere, radians: at most about 0.3 to each side.
    frequency : float
        As for `amplification`, positive.
    max_index : int
        0 to 6.
    pixels : int
        Sources on each side, 2 to 2000.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    DiffractionPattern

    Raises
    ------
    ValueError
        If an argument is invalid, or the ring of images at the caustic next to the middle of the region has no integral
        in some part of the region: the far parts of caustics that are longer than a right angle have none.

    Errors
    ------
    As for `amplification`, plus the error of the interpolation for sources in between.

    References
    ----------
    Berry & Upstill 1980, Prog. Opt. 18, 257: diffraction catastrophes.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.5, radius=16)
    >>> pattern = kc.diffraction_pattern(camera, ((1.5, 1.6), (3.1, 3.2)), 10.0, max_index=1, pixels=8)
    >>> pattern.value.shape
    (8, 8)
    """
    check_viewer(viewer)
    theta, phi = _checked_region(region)
    omega = _checked_frequency(frequency)
    at_once = np.array([omega])
    highest = whole_number("max_index", max_index, 0, HIGHEST_INDEX)
    count = whole_number("pixels", pixels, 2, _MOST_PIXELS)
    places = [*itertools.product(_GRID.tolist(), repeat=2), *_BETWEEN]
    sources = [WaveSource(viewer, SKY, (_on_side(theta, x), _on_side(phi, y))) for x, y in places]
    # The error by images that are left out is the more accurate, the more indices are known.
    here, beyond = WaveSource(viewer, SKY, (_on_side(theta, 0.0), _on_side(phi, 0.0))), min(highest + 2, HIGHEST_INDEX)
    waves, sheets = _waves(here, beyond), here.sheets(beyond)
    nearest = _nearest_order(sheets, highest, here.star)
    rings = _rings(sources, sheets, nearest, highest)
    _check_nodes(rings, omega)
    last = min(max(rings), HIGHEST_INDEX)
    free = _free([_waves(source, last) for source in sources], rings)
    steady = [index for index in range(last + 1) if len({int((part.index == index).sum()) for part in free}) == 1]
    whole = _Sum(count)
    for order, curves in rings.items():
        value = whole.add(
            partial(_field, curves[:_NODES], omega), [curve.field(at_once)[0] for curve in curves[_NODES:]]
        )
        whole.error += ring_error(curves, omega, np.abs(value), waves.ring(order))
        whole.error += _gap_error(sources, sheets, curves, waves, at_once)
    for index in steady:
        parts = [part[part.index == index] for part in free]
        whole.add(partial(_sum_of_images, parts[:_NODES], omega), [part.field(at_once)[0] for part in parts[_NODES:]])
    whole.error += float(np.abs(whole.missed).max())
    split = [waves.ring(order) for order in range(1 + nearest % 2, highest + 2, 2)]
    whole.error += _error_of_sums(free, steady, split, at_once)
    fleeting = max(float(np.minimum(part.amplitude[~np.isin(part.index, steady)], 1.0).sum()) for part in free)
    whole.error += fleeting + omitted_amplitude(waves, last)
    return DiffractionPattern(
        camera=viewer,
        surface=SKY,
        frequency=omega,
        max_index=highest,
        orders=tuple(rings),
        theta=np.linspace(*theta, count),
        phi=np.linspace(*phi, count),
        real=np.real(whole.field),
        imaginary=np.imag(whole.field),
        error=whole.error,
        remarks=(_FLEETING,) if fleeting > 0 else (),
    )


_FLEETING = "images that come and go within the region at other caustics are left out"


class _Sum:
    """The field of all pixels, its error, and its differences at the test stars between the nodes."""

    def __init__(self, pixels: int) -> None:
        self.shares = values_at(_GRID, np.linspace(-1, 1, pixels))
        self.field, self.error = np.zeros((pixels, pixels), complex), np.zeros((pixels, pixels))
        self.missed = np.zeros(len(_BETWEEN), complex)

    def add(self, part: Callable[[Array, Array], Array], between: list[complex]) -> Complex[Array, "rows columns"]:
        """A part of the field, by the weights of rows and columns; between: of the stars between the nodes."""
        value = part(self.shares, self.shares)
        self.field += value
        self.missed += np.diag(part(*(values_at(_GRID, axis) for axis in np.transpose(_BETWEEN)))) - between
        return value


def _checked_region(region: ArrayLike) -> tuple[tuple[float, float], tuple[float, float]]:
    sides = numbers("region", region)
    right = sides.shape == (2, 2) and np.isfinite(sides).all() and (sides[:, 0] < sides[:, 1]).all()
    if not right or not (sides[0, 0] > 0 and sides[0, 1] < math.pi):
        raise ValueError(
            "Argument `region` must be ((theta', theta'), (phi', phi')), each with the smaller first and theta' "
            f"between 0 and pi, but is {quoted(region)}."
        )
    (a, b), (c, d) = sides.tolist()
    return (a, b), (c, d)


def _checked_frequency(frequency: object) -> float:
    omega = real_number("frequency", frequency)
    if not LEAST_FREQUENCY <= omega <= LARGEST_FREQUENCY:
        raise ValueError(
            f"Argument `frequency` must be {LEAST_FREQUENCY:g} to {LARGEST_FREQUENCY:g}, but is {quoted(frequency)}."
        )
    return omega


def _on_side(side: tuple[float, float], x: Any) -> Any:
    """Places at x, -1 to 1, of a side."""
    return (side[0] + side[1]) / 2 + x * (side[1] - side[0]) / 2


def _nearest_order(sheets: Sheets, highest: int, star: Float[Array, " 3"]) -> int:
    """The order of the caustic that is nearest to a star."""
    curves = sheets.curves.curves[: highest + 1]
    return 1 + int(np.argmin([lengths(curve.points.direction - star).min() for curve in curves]))


def _rings(sources: list[WaveSource], sheets: Sheets, nearest: int, highest: int) -> dict[int, list[NearestCurve]]:
    """Nearest curves of all sources by order, of every second order that has them."""
    rings = {}
    for order in in_steps("ring", list(range(2 - nearest % 2, min(highest + 1, len(sheets.curves.curves)) + 1, 2))):
        curves: list[NearestCurve] = []
        for source in sources:
            curves.append(nearest_curve(source, sheets.curves, order))
            if not curves[-1].is_smooth:
                break
            if curves[-1].gap is not None:
                curves = curves_with_gap(sources, sheets.curves, order)
                break
        if len(curves) == len(sources) and all(curve.is_smooth for curve in curves):
            rings[order] = curves
        elif order == nearest:
            raise ValueError(
                "Argument `region` must lie where images at its caustic form a ring, but those of order "
                f"{order} do not: try a smaller one, or another place."
            )
    return rings


def _check_nodes(rings: dict[int, list[NearestCurve]], omega: float) -> None:
    """ValueError unless the integrals can be summed at a frequency."""
    most = min(curve.highest_frequency for curves in rings.values() for curve in curves)
    if omega > most:
        raise ValueError(
            f"Argument `frequency` must be at most {most:.3g} in this region, beyond which its fringes need too many "
            f"lines of sight, but is {omega:g}: try a smaller region, or `amplification`, which sums images."
        )


def _free(images: list[WaveImages], rings: dict[int, list[NearestCurve]]) -> list[WaveImages]:
    """The images of each source that belong to no ring, by their times."""
    free = []
    for source, waves in enumerate(images):
        held = np.zeros(len(waves), bool)
        for order, curves in rings.items():
            held |= np.isin(waves.index, (order - 1, order)) & curves[source].holds(waves.time)
        free.append(waves[~held][np.argsort(waves.time[~held])])
    return free


def _error_of_sums(
    free: list[WaveImages], steady: list[int], split: list[WaveImages], omega: Float[Array, " 1"]
) -> float:
    """The error of images that belong to no ring, and of neighbours that belong to two, which are summed."""
    alone = max(float(image_sum_error(part[np.isin(part.index, steady)], omega)[0]) for part in free)
    return alone + sum(float(ring_sum_error(ring, omega)[0]) for ring in split)


def _gap_error(
    sources: list[WaveSource], sheets: Sheets, curves: list[NearestCurve], waves: WaveImages, omega: Float[Array, " 1"]
) -> float:
    """The error of a gap in the curves of a ring."""
    order = curves[0].order
    ring, caustic = waves.ring(order), sheets.curves.curves[order - 1].points
    return max(
        float((curve.field_and_loss(omega)[1] + error_beyond_gap(ring, curve, caustic, source.star, omega))[0])
        for source, curve in zip(sources, curves, strict=True)
    )


def _field(
    curves: list[NearestCurve], omega: float, rows: Float[Array, "rows stars"], columns: Float[Array, "columns stars"]
) -> Complex[Array, "rows columns"]:
    """The integrals of stars whose integrand is a weighted mean of those of others; rows, columns: the weights."""
    count = max(max(len(curve.phase), curve.nodes(omega)) for curve in curves)
    phase, amplitude = (
        np.array([resampled(getattr(curve, name), count) for curve in curves]).reshape(_STARS, _STARS, count)
        for name in ("phase", "amplitude")
    )
    values = np.empty((len(rows), len(columns)), complex)
    few = max(1, _MOST_ENTRIES // count)
    for i, first in itertools.product(range(len(rows)), range(0, len(columns), few)):
        here = columns[first : first + few]
        bright, mean_phase = (here @ np.tensordot(rows[i], part, 1) for part in (amplitude, phase))
        values[i, first : first + few] = (bright * np.exp(1j * omega * mean_phase)).sum(axis=1)
    return curves[0].prefactor(omega) * values * (2 * math.pi / count)


def _sum_of_images(
    images: list[WaveImages], omega: float, rows: Float[Array, "rows stars"], columns: Float[Array, "columns stars"]
) -> Complex[Array, "rows columns"]:
    """The fields of images of one index that all stars have, interpolated; rows, columns: the weights."""
    amplitude, time = (
        np.array([getattr(part, name) for part in images]).reshape(_STARS, _STARS, -1) for name in ("amplitude", "time")
    )
    bright, mean_time = (np.einsum("rx,xyi,cy->irc", rows, part, columns) for part in (amplitude, time))
    turn = np.exp(-0.5j * math.pi * images[0].index)
    return np.einsum("i,irc->rc", turn, bright * np.exp(1j * omega * mean_time))


def _waves(source: WaveSource, highest: int) -> WaveImages:
    return wave_images(source, star_images(source.viewer, source.place, highest))
