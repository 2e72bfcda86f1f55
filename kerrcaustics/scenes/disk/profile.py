"""Line profiles: the light of a disk by frequency if every part of the disk emits the same line."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.beams.equatorial_plane import MOST_CROSSINGS
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.lens_map.arguments import checked_tolerance
from kerrcaustics.lens_map.domains import Ring
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.shown import Shown
from kerrcaustics.scenes.disk.disk import MOTIONS
from kerrcaustics.scenes.disk.ring_images import ring_images
from kerrcaustics.scenes.scene_checks import check_number
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import left_out, numbers, one_of, quoted, real_array, whole_number
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray
Emissivity = float | Callable[[Array], ArrayLike]

# Cells of the sum in each direction for each interval between nodes.
_CELLS = 16
_MOST_BINS = 10_000
# Intervals from rim to rim and round the middle at first; the largest numbers to which they are doubled.
_FIRST, _LAST = (8, 64), (64, 512)
# The tolerance by default, and the range of tolerances.
_TOLERANCE, _TOLERANCES = 1e-3, (1e-6, 0.1)
# Cells that are summed at once.
_AT_ONCE = 1 << 21


@result("line-profile/1")
class LineProfile(Shown):
    """The light of a line, by frequency. Sums over bins are sums of light."""

    camera: Viewer = quantity("", "", "the viewer that receives it", json="", column="")
    edges: Array = quantity("edge", "1", "edges of the bins, ascending: nu_camera / nu_emitter")
    flux: Array = quantity(
        "bin",
        "solid angle",
        "light in each bin: g^4 times the emissivity, integrated over the camera sky; NaN where unknown",
    )
    error: Array = quantity("bin", "solid angle", "estimated error of flux; infinite where unknown")
    rays: int = quantity("", "1", "beams traced")
    remarks: tuple[str, ...] = declared.remarks(default=())


@usual_warnings
def line_profile(
    camera: Viewer,
    inner: float,
    outer: float,
    emissivity: Emissivity = 3.0,
    *,
    crossing: int = 1,
    motion: str = "circular",
    bins: int | ArrayLike = 100,
    tolerance: float | None = None,
    radii: int | None = None,
    turns: int | None = None,
) -> LineProfile:
    """The profile of a line that a disk emits, in the image of one crossing of its plane.

    Parameters
    ----------
    camera : Camera or Observer
        Off the equatorial plane. Light is in steradians of the camera's sky; of an Observer in M^2, areas of (alpha,
        beta).
    inner, outer : float
        Radii of the disk's rims.
    emissivity : float, or function of the radius
        The light that the disk emits per area dr r dphi, at all frequencies: radius ** -emissivity, or the function's
        values.
    crossing : int
        Number of the crossing of the plane; no other part of the disk hides it.
    motion : str
        As for `Disk`.
    bins : int or (n + 1,) array
        Number of bins from the least to the largest frequency, or their edges.
    tolerance : float, optional
        Largest error of a bin in parts of the highest one, 1e-6 to 0.1; 1e-3 by default. The intervals are doubled
        until this is reached; a remark says where 64 by 512 of them do not reach it.
    radii, turns : int, optional
        Even numbers of intervals from rim to rim (Chebyshev nodes in ln r) and round the middle, in place of those that
        the tolerance asks for. Beams are traced at their corners alone; values in between are interpolated from all of
        them.

    Returns
    -------
    LineProfile

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `LineProfile.error`: the largest change in the bin and its neighbours when every second node is left out, the mean
    change of all bins (twice both in the outermost bins, where the horns of the line end) and, where nodes are few, the
    square of the largest change divided by the highest bin.

    References
    ----------
    Cunningham 1975, ApJ 202, 788, section II: the same integral, over frequency and radius.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=1000, inclination=0.5)
    >>> profile = kc.line_profile(camera, inner=6, outer=20)
    >>> len(profile.edges) - len(profile.flux), bool(profile.flux.sum() > 0)
    (1, True)
    """
    check_request(camera, inner, outer, motion)
    crossing = whole_number("crossing", crossing, 1, MOST_CROSSINGS)
    fixed = [None if radii is None else _even("radii", radii), None if turns is None else _even("turns", turns)]
    if None not in fixed:
        left_out("tolerance", tolerance, "beside `radii` and `turns`, which fix the accuracy")
    least = checked_tolerance(_TOLERANCE if tolerance is None else tolerance, *_TOLERANCES)
    law, division = _law(emissivity), _bins(bins)
    counts = (fixed[0] or _FIRST[0], fixed[1] or _FIRST[1])
    sampled, rays, remarks = None, 0, ()
    while True:
        sampled, more = _sampled(camera, (inner, outer), counts, crossing, motion, sampled)
        rays += more
        profile = _profile(camera, sampled, law, division, rays)
        error, highest = profile.error.max(), profile.flux.max()
        if None not in fixed or not np.isfinite(error) or error <= least * highest:
            break
        counts = _doubled(counts, fixed)
        if counts is None:
            remarks = (f"the error is {error / highest:.1g} of the highest bin, above the tolerance {least:g}",)
            break
    return replace(profile, remarks=remarks)


def _doubled(counts: tuple[int, int], fixed: list[int | None]) -> tuple[int, int] | None:
    """Twice the numbers of intervals that are not fixed; None where they would be too many."""
    radii, turns = (2 * count if number is None else count for count, number in zip(counts, fixed, strict=True))
    free = (number is None and count > last for count, number, last in zip((radii, turns), fixed, _LAST, strict=True))
    return None if any(free) else (radii, turns)


def _profile(
    camera: Viewer, sampled: "_Sampled", law: Callable[[Array], Array], division: int | Array, rays: int
) -> LineProfile:
    """The profile of samples."""
    node, fields = sampled
    edges = _edges(division, fields[0])
    if not np.isfinite(fields).all():
        unknown = np.full(len(edges) - 1, np.nan)
        return LineProfile(camera, edges, unknown, np.full(len(unknown), np.inf), rays)
    fine = sampled.summed(law, edges)
    coarse = _Sampled(node[::2], fields[:, ::2, ::2]).summed(law, edges)
    return LineProfile(camera, edges, fine, _error(fine, coarse), rays)


def _sampled(
    camera: Viewer,
    rims: tuple[float, float],
    counts: tuple[int, int],
    crossing: int,
    motion: str,
    known: "_Sampled | None",
) -> "tuple[_Sampled, int]":
    """Samples at all nodes, and the beams traced; known: samples at some of these nodes."""
    inner, outer = rims
    node = np.log(inner) + math.log(outer / inner) * (1 - np.cos(math.pi * np.arange(counts[0] + 1) / counts[0])) / 2
    turn = 2 * math.pi * np.arange(counts[1]) / counts[1]
    fields, lacking = np.empty((2, len(node), counts[1])), np.ones((len(node), counts[1]), bool)
    if known is not None:
        old = np.s_[:: counts[0] // (len(known.node) - 1), :: counts[1] // known.fields.shape[2]]
        fields[(slice(None), *old)], lacking[old] = known.fields, False
    ring, place = np.nonzero(lacking)
    images = ring_images(camera, np.exp(node)[ring], turn[place], crossing, motion)
    fields[:, lacking] = images.redshift, np.log(images.redshift**4 * images.solid_angle)
    return _Sampled(node, fields), images.rays


def check_request(camera: Viewer, inner: float, outer: float, motion: str) -> None:
    """Raise ValueError unless the ring is valid, and the viewer is off the plane."""
    check_viewer(camera)
    Ring(camera, EquatorialPlane(1)).check()
    one_of("motion", motion, MOTIONS)
    horizon = kerr.horizon(camera.spin)
    must = f"be finite and larger than the horizon radius {horizon:.12g}"
    check_number("inner", inner, must, lambda radius: horizon < radius < math.inf)
    check_number("outer", outer, f"be larger than `inner` ({inner:g})", lambda radius: inner < radius < math.inf)
    if not EMITTERS[motion](camera.spin, np.array(float(inner)), 0.0).slowness > 0:
        raise ValueError(f"Argument `inner` must be a radius where `motion` {motion!r} is possible, but is {inner:g}.")


def _error(fine: Array, coarse: Array) -> Float[Array, " bins"]:
    """The error of the light in bins, from the light with half as many nodes in either direction.

    The change of a bin may be small by chance: its neighbours and the mean over all bins count as well.
    """
    change = np.pad(np.abs(fine - coarse), 1)
    near = np.maximum(np.maximum(change[:-2], change[2:]), change[1:-1]) + change.mean()
    # The horns of the line end in the outermost bins with light: there an error falls no faster than to a half.
    near[np.flatnonzero(fine)[[0, -1]] if fine.any() else []] *= 2
    return near + change.max() ** 2 / max(fine.max(), np.finfo(float).tiny)


def _even(name: str, value: Any) -> int:
    if whole_number(name, value, 4, 4096) % 2:
        raise ValueError(f"Argument `{name}` must be an even whole number from 4 to 4096, but is {quoted(value)}.")
    return int(value)


def _bins(bins: Any) -> int | Array:
    """The number of bins, or their edges."""
    if np.ndim(bins) == 0:
        return whole_number("bins", bins, 1, _MOST_BINS)
    edges = numbers("bins", bins)
    if edges.ndim != 1 or len(edges) < 2 or not (np.isfinite(edges).all() and (np.diff(edges) > 0).all()):
        raise ValueError("Argument `bins` must be a whole number, or ascending edges, an array of shape (n + 1,).")
    return edges


def _edges(bins: int | Array, redshift: Array) -> Float[Array, " edges"]:
    """The edges of the bins, slightly beyond the extremes at the nodes, and not negative."""
    if not isinstance(bins, int):
        return bins
    finite = redshift[np.isfinite(redshift)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    beyond = 0.01 * (high - low) + 1e-12 * high
    return np.linspace(max(low - beyond, 0.0), high + beyond, bins + 1)


def _law(emissivity: Any) -> Callable[[Array], Array]:
    """The emissivity as a function of the radius."""
    if not callable(emissivity):
        power = check_number("emissivity", emissivity, "be a number or a function")
        return lambda radius: radius**-power

    def values(radius: Array) -> Array:
        light = real_array("emissivity", emissivity(radius)) + np.zeros_like(radius)
        if not (np.isfinite(light).all() and (light >= 0).all()):
            raise ValueError("Argument `emissivity` must be a function whose values are numbers from 0 on.")
        return light

    return values


class _Sampled(NamedTuple):
    """Samples of a disk at nodes.

    node: (radii,) ln r of the nodes.
    fields: (2, radii, turns) frequency ratio g, and the logarithm of g^4 times the solid angle.
    """

    node: Array
    fields: Array

    def summed(self, law: Callable[[Array], Array], edges: Array) -> Float[Array, " bins"]:
        """The light between edges, from cells in which the frequency is linear."""
        steps, turns = _CELLS * (len(self.node) - 1), _CELLS * self.fields.shape[2]
        width = (self.node[-1] - self.node[0]) / steps
        at = self.node[0] + width * (np.arange(steps) + 0.5)
        fields = round_about(self.fields, _CELLS)
        total = np.zeros(len(edges) - 1)
        for part in np.array_split(at, -(-steps * turns // _AT_ONCE)):
            across, slope = barycentric(self.node, part)
            shift, weight = across @ fields
            along = (np.roll(shift, -1, axis=1) - np.roll(shift, 1, axis=1)) / 2
            light = np.exp(weight) * (law(np.exp(part)) * width * 2 * math.pi / turns)[:, None]
            radial = slope @ fields[0] * width
            total += binned(shift.ravel(), radial.ravel(), along.ravel(), light.ravel(), edges)
        return total


def binned(shift: Array, start: Array, stop: Array, light: Array, edges: Array) -> Float[Array, " bins"]:
    """The light of cells between edges: `shift` (n,) in their middles, its changes (n,) along two sides, the light."""
    reach = (np.abs(start) + np.abs(stop)) / 2
    first, last = np.searchsorted(edges, shift - reach), np.searchsorted(edges, shift + reach)
    # Light below each edge: of the cells that end below it, and of parts of the cells that it cuts.
    below = np.cumsum(np.bincount(last, light, len(edges) + 1))[: len(edges)]
    cut = np.flatnonzero(first < last)
    for k in range(int(np.max(last - first, initial=0))):
        cut = cut[first[cut] + k < last[cut]]
        edge = first[cut] + k
        part = kernel("covered_part").on_rays((), (edges[edge] - shift[cut], start[cut], stop[cut]))
        below += np.bincount(edge, part * light[cut], len(edges))
    return np.diff(below)


def round_about(values: Float[Array, "*batch turns"], parts: int) -> Float[Array, "*batch _more"]:
    """Values of a periodic function in the middles of equal parts of each interval, by its Fourier series."""
    count = values.shape[-1]
    waves = np.fft.rfft(values, axis=-1)
    order = np.arange(waves.shape[-1])
    # The wave of the highest order belongs to both senses, half to each.
    waves = waves * np.where(order == count / 2, 0.5, 1.0) * np.exp(1j * math.pi * order / (count * parts))
    return np.fft.irfft(waves, count * parts, axis=-1) * parts


def barycentric(node: Float[Array, " nodes"], at: Float[Array, " n"]) -> tuple[Array, Array]:
    """Matrices (n, nodes) of the polynomial through Chebyshev nodes and of its slope, at places that are not nodes."""
    sign = (-1.0) ** np.arange(len(node))
    sign[[0, -1]] /= 2
    gap = at[:, None] - node
    parts = sign / gap
    total = parts.sum(axis=1, keepdims=True)
    value = parts / total
    # d/dx of (w / gap) / sum(w / gap).
    steep = (parts / gap).sum(axis=1, keepdims=True) / total
    return value, value * (steep - 1 / gap)
