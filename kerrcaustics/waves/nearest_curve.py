"""The curve on the camera sky that sums the waves of a ring of images: on each line, what leads nearest to the star.

On that curve the field is one integral, sum of A exp(i omega Phi): its stationary places are the images, with their
times and amplitudes, and it stays finite at folds, cusps and on axial caustics. Along a line position is kept, across
it momentum (Maslov's mixed representation).
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import CelestialSphere, Sphere
from kerrcaustics.beams.trace import trace_beams, trace_rays
from kerrcaustics.curves.critical_curves import CriticalCurves
from kerrcaustics.lens_map.domains import Ring, domain_of
from kerrcaustics.lens_map.search_sky import TOLERANCE, SearchSky, search_sky
from kerrcaustics.lens_map.sky_lines import periodic
from kerrcaustics.spacetime.frame import sky_from_line_of_sight
from kerrcaustics.spacetime.sphere import lengths, polar_basis, tangent_basis
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray

FARTHEST = 1.1
"""Farthest nearest places from the star, radians: the integral is asymptotic in that distance too."""

# Lines at first, and at most; part of the largest Fourier coefficient that the last ones may have, with which the curve
# is taken for smooth, with which it is still of use, and with which the nearest place jumps.
_LINES, _MOST_LINES, _SMOOTH, _ROUGH, _JUMPS = 64, 1024, 1e-7, 1e-5, 1e-2
# Steps of the secant method along a line, in depth: the first, the longest, how many, and the last.
_FIRST, _LONGEST, _MOST_STEPS, _LAST = 1e-3, 0.3, 30, 1e-8
# Places on each line where the nearest one is looked for, the depth of the outermost, and the error of their rays.
_SAMPLES, _OUTERMOST, _OF_SAMPLES = 24, 0.02, 1e-8
# Below it a phase is round-off: on an axis it is constant.
_TINY = 1e-3
# By the frequency.
_NEXT_PHASE = 1 / 24
# The growth of the error by the square of the farthest nearest place, radians, and by the inverse radius of the viewer,
# as partial waves show it.
_FAR_OFF = 6.5
# Differences along the sky's coordinates.
_DIFFERENCE = 1e-5
# Nodes of the sum: per radian of phase that passes in a turn, and at least.
_PER_RADIAN, _LEAST_NODES = 1.2, 40
# Most entries that are held at once.
_MOST_ENTRIES = 4_000_000


@dataclass(frozen=True, eq=False)
class NearestCurve:
    """The integrand of a ring of images, at equally spaced lines.

    order: of the critical curve; phase: T - B . n_s; amplitude: of the sum; away: distance of the nearest place from
    the star, radians; roughness: the last Fourier coefficients by the largest; is_smooth: whether the curve is one, and
    every line crosses it once.
    """

    order: int
    phase: Float[Array, " lines"]
    amplitude: Float[Array, " lines"]
    far_off: float
    roughness: float
    is_smooth: bool

    @property
    def fastest(self) -> float:
        """The largest rate of the phase along the curve."""
        return float(np.abs(_rate(self.phase)).max())

    @property
    def brightest(self) -> float:
        """The integral of the amplitude, by which the field grows with the root of the frequency at most."""
        return float(self.amplitude.mean()) * math.sqrt(2 * math.pi)

    def nodes(self, omega: float) -> int:
        """Number of nodes that the sum needs at a frequency: with fewer it is wrong, and does not show it."""
        return math.ceil(_PER_RADIAN * abs(omega) * self.fastest + _LEAST_NODES)

    def field(self, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
        """The sum at frequencies that are not 0."""
        count = max(len(self.phase), max(map(self.nodes, omega.tolist()), default=0))
        phase, amplitude = resampled(self.phase, count), resampled(self.amplitude, count)
        rows = max(1, _MOST_ENTRIES // count)
        parts = [np.empty(0, complex)]
        for first in range(0, len(omega), rows):
            w = omega[first : first + rows]
            parts.append(np.exp(1j * w[:, None] * phase) @ amplitude)
        return self.turned(omega) * np.concatenate(parts) * (2 * math.pi / count)

    def turned(self, omega: Any) -> Any:
        """The factor before the integral."""
        turn = np.exp(-0.25j * math.pi - 0.5j * math.pi * (self.order - 1))
        return np.sqrt(omega / (2 * math.pi)) * turn * next_order(self.order, omega)


def next_order(order: int, omega: Any) -> Any:
    """The next order of the asymptotics across a ring as a phase: that of a point mass for the primary one, else 1."""
    return np.exp(1j * _NEXT_PHASE / omega) if order == 1 else 1.0


def nearest_curve(source: WaveSource, curves: CriticalCurves, order: int) -> NearestCurve:
    """The nearest curve of a source among the images beside the critical curve of an order."""
    count, sky = _LINES, search_sky(source.viewer)
    while True:
        curve = _with_lines(sky, source, order, *_first_depths(sky, source, curves, order, count))
        if curve.is_smooth or 2 * count > _MOST_LINES or (count > _LINES and curve.roughness > _JUMPS):
            return curve
        count *= 2


def _first_depths(
    sky: SearchSky, source: WaveSource, curves: CriticalCurves, order: int, count: int
) -> tuple[Float[Array, " lines"], Float[Array, " lines"], Float[Array, " lines"]]:
    """Depths on lines next to the place that is nearest to the star, and the range in which they belong to the ring."""
    edge_phase = _turns(count)
    here = _depth(curves, order, edge_phase)
    inner = _depth(curves, order + 1, edge_phase) if order < len(curves.curves) else None
    outer = _depth(curves, order - 1, edge_phase) if order > 1 else None
    # Within a right angle of the caustic: farther off the same direction comes again.
    first = np.full(count, _OUTERMOST) if outer is None else (outer + here) / 2
    last = here + (here - first if inner is None else (inner - here) / 2)
    part = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    depth = first[:, None] + part * (last - first)[:, None]
    lines = _LineFamily(sky.search_camera, source.surface, np.repeat(edge_phase, _SAMPLES))
    rays = trace_rays(sky.search_camera, lines.sky(depth.ravel()), "auto", _OF_SAMPLES, end=source.surface)
    away = np.nan_to_num(lengths(rays.direction - source.star), nan=math.inf).reshape(depth.shape)
    return depth[np.arange(count), away.argmin(axis=1)], first, last


def _depth(curves: CriticalCurves, order: int, edge_phase: Float[Array, " lines"]) -> Float[Array, " lines"]:
    """Depths of a critical curve on lines."""
    points = curves.curves[order - 1].points
    phase, first = np.unique(points.edge_phase % (2 * math.pi), return_index=True)
    return periodic(phase, points.depth[first])(edge_phase)


def _with_lines(
    sky: SearchSky,
    source: WaveSource,
    order: int,
    depth: Float[Array, " lines"],
    first: Float[Array, " lines"],
    last: Float[Array, " lines"],
) -> NearestCurve:
    """The curve at so many lines, from depths beside it; first, last: their range."""
    star, lines = source.star, _LineFamily(sky.search_camera, source.surface, _turns(len(depth)))
    depth, here, lost = _nearest(lines, star, depth)
    beams, along = here.beams, here.along
    n = beams.direction
    impact = _impact_vectors(lines, depth, here)
    ahead = np.cross(n, along) / lengths(along)[:, None]
    pushed = np.einsum("nx,nx->n", ahead, _rate(impact))
    turned = (lines.sky(depth, _DIFFERENCE) - lines.sky(depth, -_DIFFERENCE)) / (2 * _DIFFERENCE)
    area = lengths(np.cross(turned, here.deeper)) * sky.still_lengths(here.sky) ** 2
    with np.errstate(invalid="ignore", divide="ignore"):
        amplitude = source.amplitudes(sky.search_camera, here.sky, beams, np.abs(pushed) * area / lengths(along))
    phase = sky.viewer_time(here.time, np.zeros(len(n)))[0] - impact @ star
    is_whole = bool(np.isfinite(phase).all() and np.isfinite(amplitude).all())
    one_way = bool((pushed > 0).all() or (pushed < 0).all())
    tail = max(_tail(phase - phase.mean()), _tail(amplitude)) if is_whole else math.inf
    smooth = _SMOOTH if 2 * len(depth) <= _MOST_LINES else _ROUGH
    away = 2 * np.arcsin(np.clip(lengths(n - star) / 2, 0, 1))
    near = bool(((depth > first) & (depth < last) & (away < FARTHEST)).all())
    is_smooth = is_whole and one_way and near and not lost and tail < smooth
    far_off = 1 + _FAR_OFF * source.nearness * float(away.max()) ** 2
    return NearestCurve(order, phase, amplitude, far_off, tail, is_smooth)


@dataclass(frozen=True, eq=False)
class _Here:
    """Places on lines: directions N and their derivatives by depth; beams; n' by depth."""

    sky: Float[Array, "lines 3"]
    deeper: Float[Array, "lines 3"]
    beams: Beams
    along: Float[Array, "lines 3"]

    @property
    def time(self) -> Float[Array, " lines"]:
        """Times of travel."""
        assert self.beams.time is not None
        return self.beams.time


@dataclass(frozen=True, eq=False)
class _LineFamily:
    camera: Viewer
    surface: CelestialSphere | Sphere
    edge_phase: Float[Array, " lines"]

    def sky(self, depth: Float[Array, " lines"], turn: float = 0.0) -> Float[Array, "lines 3"]:
        domain = domain_of(self.surface, self.camera)
        assert not isinstance(domain, Ring)
        line_of_sight, _ = domain.line_of_sight(self.edge_phase + turn, depth)
        return sky_from_line_of_sight(self.camera.frame(), line_of_sight)

    def at(self, depth: Float[Array, " lines"]) -> _Here:
        sky, step = self.sky(depth), _DIFFERENCE
        deeper = (self.sky(depth + step) - self.sky(depth - step)) / (2 * step)
        beams = trace_beams(
            self.camera,
            sky,
            "auto",
            TOLERANCE,
            end=self.surface,
            time=True,
            index=False,
            crossings=False,
            redshift=False,
            constants=True,
        )
        drift = np.einsum("nx,anx->na", deeper, np.array(tangent_basis(sky)))
        step_there = np.einsum("nij,nj->ni", beams.jacobian, drift)
        along = np.einsum("ni,inx->nx", step_there, np.array(polar_basis(beams.direction)))
        return _Here(sky, deeper, beams, along)


def _nearest(
    lines: _LineFamily, star: Float[Array, " 3"], depth: Float[Array, " lines"]
) -> tuple[Float[Array, " lines"], _Here, bool]:
    """Depths at which n' comes nearest to the star, by the secant method, and whether some are still to be found."""
    last = depth - _FIRST
    before, here = lines.at(last).along @ star, lines.at(depth)
    moving = np.ones(len(depth), bool)
    for _ in range(_MOST_STEPS):
        value = here.along @ star
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -value * (depth - last) / (value - before)
        # Where a line is there, differences are round-off.
        step = np.where(moving, np.clip(np.nan_to_num(step), -_LONGEST, _LONGEST), 0.0)
        last, before, depth = depth, value, depth + step
        here = lines.at(depth)
        moving &= np.abs(step) > _LAST
        if not moving.any():
            break
    return depth, here, bool(moving.any())


def _impact_vectors(lines: _LineFamily, depth: Float[Array, " lines"], here: _Here) -> Float[Array, "lines 3"]:
    """Impact vectors of the rays' asymptotes, about the hole: dT = -B . dn' gives the sign of the polar part."""
    beams, n = here.beams, here.beams.direction
    assert beams.impact is not None
    assert beams.carter is not None
    south, east = polar_basis(n)
    sine = np.hypot(n[:, 0], n[:, 1])
    azimuthal = beams.impact / sine
    squared = beams.carter + (lines.camera.spin**2 - azimuthal**2) * n[:, 2] ** 2
    polar = np.sqrt(np.maximum(squared, 0))
    step = 10 * _DIFFERENCE
    slopes = [
        ((lines.at(depth + step).time - lines.at(depth - step).time) / (2 * step), here.along),
        (_rate(here.time), _rate(n)),
    ]
    miss = []
    for side in (1, -1):
        impact = side * polar[:, None] * south + azimuthal[:, None] * east
        miss.append(sum(np.abs(slope + _dot(step, impact)) for slope, step in slopes))
    sign = np.where(miss[0] <= miss[1], 1.0, -1.0)
    return (sign * polar)[:, None] * south + azimuthal[:, None] * east


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("nx,nx->n", a, b)


def _turns(count: int) -> Float[Array, " lines"]:
    return 2 * math.pi * np.arange(count) / count


def resampled(values: Float[Array, " lines"], count: int) -> Float[Array, " nodes"]:
    """A periodic function at more equally spaced places, by its Fourier series."""
    if count == len(values):
        return values
    return np.fft.irfft(np.fft.rfft(values), count) * (count / len(values))


def _rate(values: Array) -> Array:
    """The derivative of a periodic function of 2 pi, by its Fourier series."""
    series = np.fft.rfft(values, axis=0)
    order = np.arange(len(series))
    order[-1] = 0
    return np.fft.irfft((1j * order).reshape(-1, *[1] * (values.ndim - 1)) * series, len(values), axis=0)


def _tail(values: Float[Array, " lines"]) -> float:
    """The largest of the last quarter of Fourier coefficients, by the largest of all, or by that of a tiny function."""
    series = np.abs(np.fft.rfft(values))
    return float(series[-len(series) // 4 :].max() / max(series.max(), _TINY * len(values)))
