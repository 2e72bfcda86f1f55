"""A volume in the pixels of a picture, divided by the crossings of a disk: marched rays, finer where pixels differ."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.beams.trace import cores
from kerrcaustics.results.declared import same
from kerrcaustics.results.progress import report
from kerrcaustics.results.stages import stage
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.scenes.disk.disk import Disk
from kerrcaustics.scenes.disk.march import Marched, Marching, marched_between
from kerrcaustics.scenes.disk.orbiting_spots import OrbitingSpots
from kerrcaustics.scenes.disk.volume import Volume
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.sky import Shifts
from kerrcaustics.shapes import Bool, Float, Real
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import instance_of
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Rays that one core marches at a time: they fit in its cache.
_TOGETHER = 1 << 12
# Difference of neighbouring pixels, in parts of the brightest or of the transmission, above which they are divided.
_ROUGH = 1 / 24
# Rays each way in such pixels.
_DIVISIONS = 3
# Number of pixels whose rays are marched again in half the steps, for the error.
_SAMPLE = 256
# Length of a step, as of `render_volume`, and its length in a draft.
_STEP, _DRAFT_STEP = 0.5, 1.5


class Veil(NamedTuple):
    """Light and transmission of a volume in n pixels, row by row, divided by the k crossings of a disk.

    light: (k + 1, n, 3) light from before the first crossing, from between it and the second, and so on, dimmed by the
        matter in front.
    transmission: (k + 1, n) transmission of the matter up to each crossing, and of all.
    supersampled: number of supersampled pixels.
    rays: number of rays marched.
    steps: number of steps of all rays.
    """

    light: Array
    transmission: Array
    supersampled: int
    rays: int
    steps: int

    def total(self) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """Light and transmission of the whole volume."""
        return self.light.sum(axis=0), self.transmission[-1]


Glowing = Volume | OrbitingSpots
"""Matter in space, or spots in its place."""


class Matter(NamedTuple):
    """Matter round the hole.

    disk: a disk, or None.
    volume: matter in space, or spots in its place, or None.
    """

    disk: Disk | None = None
    volume: Glowing | None = None

    @property
    def exists(self) -> bool:
        """True if there is a disk or a volume."""
        return self.disk is not None or self.volume is not None


# The last volume, everything else on which its picture depends, and that picture.
_LAST: list[tuple[Glowing, tuple[Any, ...], Veil]] = []


def check_volume(volume: Glowing | None, camera: Viewer) -> None:
    """Raise ValueError unless a volume, or spots in its place, are valid; None is valid."""
    if isinstance(volume, OrbitingSpots):
        volume.check(camera.spin)
        if not isinstance(camera, Camera):
            raise ValueError("Argument `camera` must be a Camera for spots on orbits of their own.")
    elif volume is not None:
        instance_of("volume", volume, Volume)
        volume.check(camera.spin)


def veil_over(
    camera: Viewer,
    view: Raster,
    volume: Glowing | None,
    shifts: Shifts,
    crossings: int,
    when: tuple[float, bool],
    draft: bool = False,
) -> Veil | None:
    """The veil of a volume over a view: the last veil if it is the same, as for a camera on a circular orbit.

    when: time and delay, for spots.
    draft: True for long steps, and one ray for each pixel.
    """
    if volume is None:
        return None
    check_volume(volume, camera)
    moving = isinstance(volume, OrbitingSpots)
    step = _DRAFT_STEP if draft else _STEP
    marching = Marching(camera, volume.traces(camera.spin, *when) if moving else volume, *shifts, step, crossings)
    key = camera, view, shifts, crossings, when if moving else None, draft
    # `_LAST` is read once, as another thread may replace its item.
    last = next(iter(_LAST), None)
    if last is None or last[0] is not volume or not same(last[1], key):
        _LAST.clear()
        with stage("volume"):
            last = volume, key, veil_of(marching, view, refine=not draft)
        _LAST[:] = [last]
    return last[2]


def veil_of(marching: Marching, view: Raster, refine: bool = True) -> Veil:
    """The veil of a volume: one ray for each pixel, or the mean of nine where neighbouring pixels differ.

    refine: False for one ray everywhere.
    """
    y, x = (place.ravel() for place in np.mgrid[: view.height, : view.width])
    report("light along the rays", 0.0)
    light, transmission, steps = _all_marched(marching, view, x[:, None], y[:, None])
    grey = luminance(light.sum(axis=0)).reshape(view.height, -1)
    rough = np.zeros(0, int)
    if refine:
        rough = np.flatnonzero(_rough(grey / max(float(grey.max()), 1e-300), transmission))
    if len(rough):
        within = (np.arange(_DIVISIONS**2) % _DIVISIONS + 0.5) / _DIVISIONS - 0.5
        down = (np.arange(_DIVISIONS**2) // _DIVISIONS + 0.5) / _DIVISIONS - 0.5
        report("more rays at edges", 0.5)
        places = x[rough, None] + within, y[rough, None] + down
        light[:, rough], transmission[:, rough], more_steps = _all_marched(marching, view, *places)
        steps += more_steps
    return Veil(light, transmission, len(rough), len(x) + len(rough) * _DIVISIONS**2, steps)


def step_error(marching: Marching, view: Raster, veil: Veil) -> float:
    """4/3 of the largest change with half the step, over a sample of the pixels that see matter."""
    light, transmission = veil.total()
    with_matter = np.flatnonzero((transmission < 1) | light.any(axis=1))
    if not len(with_matter):
        return 0.0
    which = np.random.default_rng(0).permutation(with_matter)[:_SAMPLE]
    y, x = np.divmod(which, view.width)
    marches = (replace(marching, step=marching.step / part) for part in (1, 2))
    coarse, fine = (_all_marched(march, view, x[:, None], y[:, None]) for march in marches)
    brightest = max(float(luminance(light).max()), 1e-300)
    darker = np.abs(luminance((fine.light - coarse.light).sum(axis=0))) / brightest
    clearer = np.abs(fine.transmission - coarse.transmission)
    return float(4 / 3 * max(darker.max(), clearer.max()))


def _all_marched(marching: Marching, view: Raster, x: Real[Array, "n m"], y: Real[Array, "n m"]) -> Marched:
    """Means over the m rays of n pixels, on all cores."""
    count = max(_TOGETHER // x.shape[1], 1)

    def part(start: int) -> Marched:
        rows = slice(start, start + count)
        sky, steps = view.directions(x[rows].ravel(), y[rows].ravel())
        light, transmission, step_counts = marched_between(marching, sky, steps)
        several = marching.crossings + 1, len(x[rows]), x.shape[1]
        means = light.reshape(*several, 3).mean(axis=2), transmission.reshape(several).mean(axis=2)
        return Marched(*means, step_counts)

    with ThreadPoolExecutor(cores()) as pool:
        parts = list(pool.map(part, range(0, len(x), count)))
    light, transmission, step_counts = zip(*parts, strict=True)
    return Marched(np.concatenate(light, axis=1), np.concatenate(transmission, axis=1), sum(step_counts))


def _rough(grey: Float[Array, "h w"], transmission: Float[Array, "layers pixels"]) -> Bool[Array, "h w"]:
    """True for pixels that differ much from a neighbour."""
    mask = np.zeros(grey.shape, bool)
    for picture in (grey, *transmission.reshape(-1, *grey.shape)):
        for axis in (0, 1):
            edge = np.abs(np.diff(picture, axis=axis)) > _ROUGH
            mask |= np.pad(edge, [(0, 1 - axis), (0, axis)]) | np.pad(edge, [(1 - axis, 0), (axis, 0)])
    return mask
