"""Blurred light: of a sky, of a disk and of a volume while camera, view and time move (blur.py).

Light that is spread over the sky is averaged over footprints swept along their motion, and stars are drawn along their
traces (sky_light.py); if the camera moves far, in pieces of the exposure. A disk and a volume are the mean of several
moments.
"""

import math
from collections.abc import Sequence
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.ends import Spherical
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.results.stages import stage
from kerrcaustics.scenes.blur import Blur, sky_turn
from kerrcaustics.scenes.colour import DAYLIGHT
from kerrcaustics.scenes.disk.crossings import FINEST, DiskCrossings, Lattice, covered, crossings
from kerrcaustics.scenes.disk.disk import Disk
from kerrcaustics.scenes.disk.emission import BlackBody, Swatches
from kerrcaustics.scenes.disk.lighting import Looks, disk_light
from kerrcaustics.scenes.disk.orbiting_spots import OrbitingSpots
from kerrcaustics.scenes.disk.turned import turned_disk, turned_volume
from kerrcaustics.scenes.disk.veil import Glowing, Matter, veil_over
from kerrcaustics.scenes.motion import ExposedMoment, Exposure
from kerrcaustics.scenes.points import steps_to
from kerrcaustics.scenes.seen_sky import SeenSky, seen_sky
from kerrcaustics.scenes.sky import Shifts, Sky
from kerrcaustics.scenes.sky_light import sky_light
from kerrcaustics.scenes.sky_map import CROOKED, TOLERANCE, ray_directions, slopes
from kerrcaustics.scenes.star_search import StarSearch
from kerrcaustics.shapes import Bool, Float

Array = np.ndarray

# Part of the picture that decides on the number of pieces of an exposure, each with a map of its own.
_MOST_OF = 0.75
# Longest motion of that part within a piece, pixels.
_LONGEST_PIECE = 6.0
# Largest number of pieces.
_MOST_PIECES = 32
# Places, across and down, from which the motion of a picture is estimated.
_PROBED = (12, 8)
# Largest motion of matter between two moments for a camera whose view stays, pixels: all moments share their rays.
_STEP_AT_REST = 0.5
# The same for a moving camera, pixels: each moment has rays of its own.
_STEP_MOVING = 1.0
# Largest number of these moments.
_MOST_MOMENTS = 32


class MatterLight(NamedTuple):
    """Light of matter.

    light: (h, w, 3) linear light.
    transmission: (h, w) part of the light behind that comes through; None without matter.
    hidden: (h, w) True for pixels that see nothing but an opaque disk.
    beams: numbers of beams to each crossing of the disk.
    """

    light: Array
    transmission: Array | None
    hidden: Array
    beams: tuple[int, ...]


def without_matter(shape: tuple[int, int]) -> MatterLight:
    """The light of no matter in a picture of h x w pixels."""
    return MatterLight(np.zeros((*shape, 3), np.float32), None, np.zeros(shape, bool), ())


def blurred_sky(
    blur: Blur, sky: Sky, shifts: Shifts, close: float, hidden: Bool[Array, "h w"], end: Spherical
) -> tuple[Float[Array, "h w 3"], SeenSky]:
    """The light of a sky over an exposure, and the visible sky: of its first piece, with the largest errors of all.

    close, hidden, end: as for `sky_map`.
    """
    pieces = blur.pieces(_piece_count(blur.exposure, end)) if blur.camera_moves else [blur]
    lights, skies = zip(*(_piece_light(piece, sky, shifts, close, hidden, end) for piece in pieces), strict=True)
    shares = blur.exposure.weight.divided(len(pieces)).light.tolist()
    fraction = _mean(shares, [part.visible_fraction for part in skies])
    supersampled, error = (max(getattr(part, name) for part in skies) for name in ("supersampled", "error"))
    beams = sum(part.beams for part in skies)
    whole = SeenSky(skies[0].cells, skies[0].parts, fraction, supersampled, beams, error)
    return _mean(shares, lights), whole


def _mean(shares: list[float], pictures: Sequence[Array]) -> Float[Array, "h w *channels"]:
    """The mean of pictures, each times its share of the light."""
    several = [share * picture for share, picture in zip(shares, pictures, strict=True)]
    return np.asarray(np.mean(several, axis=0, dtype=np.float32))


def _piece_light(
    blur: Blur, sky: Sky, shifts: Shifts, close: float, hidden: Bool[Array, "h w"], end: Spherical
) -> tuple[Float[Array, "h w 3"], SeenSky]:
    """The light of a sky over one piece of an exposure, and the visible sky."""
    camera, view, _, _ = blur.exposure.middle
    visible = seen_sky(camera, view, close, hidden, blur.moving_exposure, end)

    def search() -> StarSearch:
        return StarSearch(camera, view, visible.cells, visible.visible_fraction, blur.moving_exposure, end)

    turn = sky_turn(sky, blur.turn, blur.exposure.weight)
    return sky_light(camera, view, sky, visible.cells, visible.parts, search, shifts, turn, end), visible


def _piece_count(exposure: Exposure, end: Spherical) -> int:
    """Number of pieces of an exposure, from the motion of most places of the picture over the sky."""
    x, y = _probes(exposure)
    camera, view, _, _ = exposure.middle
    sky, steps = view.directions(x, y)
    beams = beams_of_directions(camera, sky, "auto", TOLERANCE, index=False, crossings=False, redshift=False, end=end)
    first, last = (ray_directions(moment, x, y, end) for moment in (exposure.first, exposure.last))
    columns = np.swapaxes(slopes(beams, sky, steps), 1, 2)
    offsets = last - first, (first + last) / 2 - beams.direction
    moved, bent = (np.abs(steps_to(columns, offset)).max(axis=1) for offset in offsets)
    finite = np.isfinite(moved)
    if not finite.any():
        return 1
    # The deviation from a straight line goes with the square of the time.
    far, crooked = (np.quantile(part[finite], _MOST_OF) for part in (moved, bent))
    count = max(far / _LONGEST_PIECE, math.sqrt(crooked / CROOKED))
    return int(np.clip(np.ceil(count), 1, _MOST_PIECES))


def _probes(exposure: Exposure) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Places of the picture at which its motion is estimated, pixels."""
    view = exposure.middle.view
    across, down = ((np.arange(n) + 0.5) / n for n in _PROBED)
    x, y = np.meshgrid(across * view.width - 0.5, down * view.height - 0.5)
    return x.ravel(), y.ravel()


@stage("disk_light")
def blurred_matter(blur: Blur, matter: Matter, shifts: Shifts, delay: bool) -> MatterLight:
    """The mean light of a disk and a volume over as many moments as their patterns and rims move pixels."""
    disk, volume = matter
    exposure, view = blur.exposure, blur.exposure.middle.view
    count = max(_moment_count(blur, part) for part in (disk, _stand_in(volume)) if part is not None)
    light, transmission = np.zeros((*view.shape, 3), np.float32), np.zeros(view.shape, np.float32)
    hidden, plane, beams = np.full(view.shape, disk is not None and disk.opaque), None, []
    parts = exposure.weight.divided(count)
    for number, (time, share) in enumerate(zip(parts.moment.tolist(), parts.light.tolist(), strict=True)):
        moment = exposure.moment_at(time)
        if plane is None or blur.camera_moves:
            plane = _crossings(moment, disk, delay, (number, count) if blur.camera_moves else (0, 1))
            beams = [sum(counts) for counts in zip_longest(beams, plane.beams, fillvalue=0)]
            if disk is not None and disk.opaque:
                hidden &= covered(plane.cells, view.shape, disk.inner, disk.outer)
        looks = Looks(moment.camera.spin, *shifts, delay, moment.time)
        turned = None if volume is None else turned_volume(volume, -moment.azimuth)
        veil = veil_over(moment.camera, moment.view, turned, shifts, len(plane.cells), (moment.time, delay))
        pattern = disk and turned_disk(disk, -moment.azimuth)
        glow, passing = disk_light(pattern, plane.cells, view.shape, looks, veil)
        light += share * glow / count
        transmission += share * passing / count
    return MatterLight(light, transmission, hidden, tuple(beams))


def _crossings(moment: ExposedMoment, disk: Disk | None, delay: bool, rays: tuple[int, int]) -> DiskCrossings:
    """The crossings of a disk at a moment; rays: its number and the number of all, 0 and 1 for a map that all share."""
    if disk is None:
        return DiskCrossings((), ())
    lattice = Lattice.at_moment(moment.camera, moment.view, delay, *rays)
    return crossings(lattice, disk.inner, disk.outer, disk.opaque)


def _stand_in(volume: Glowing | None) -> Disk | None:
    """A disk between the rims of a volume whose places move over a picture as those of the volume do."""
    if volume is None:
        return None
    emission = BlackBody(DAYLIGHT) if volume.symmetric else Swatches()
    motion = "circular" if isinstance(volume, OrbitingSpots) else "static"
    return Disk(volume.inner, volume.outer, emission, motion=motion)


def _moment_count(blur: Blur, disk: Disk) -> int:
    """Number of moments of a disk, from the motion of its pattern and rims over the picture."""
    exposure, patterned = blur.exposure, callable(disk.opacity) or not disk.emission.symmetric
    if not blur.camera_moves and not patterned:
        return 1
    lattice = Lattice(exposure.middle.camera, exposure.middle.view, False)
    x, y = (np.round((place + 0.5) * FINEST).astype(int) for place in _probes(exposure))
    corners = lattice.trace(np.sort(lattice.key(x, y)), 1)
    y, x = np.divmod(corners.key, lattice.columns)
    moments = exposure.first, exposure.last
    ends = [lattice._replace(camera=end.camera, view=end.view).rays(x, y, 1)[0] for end in moments]
    on_disk = [(end[:, 0] > 1 / disk.outer) & (end[:, 0] < 1 / disk.inner) for end in (corners.place, *ends)]
    moved = ends[1] - ends[0]
    radius = np.clip(1 / corners.place[:, 0], disk.inner, disk.outer)
    circled = disk.orbital(lattice.camera.spin, radius) * (exposure.last.time - exposure.first.time)
    moved[:, 1] = np.remainder(moved[:, 1] - exposure.turn + math.pi, 2 * math.pi) - math.pi - circled
    pixels = np.abs(moved) / np.sqrt((corners.slope**2).sum(axis=-1))
    farthest = pixels[:, : 2 if patterned else 1].max(axis=1)
    farthest = farthest[np.logical_or.reduce(on_disk) & np.isfinite(farthest)]
    step = _STEP_MOVING if blur.camera_moves else _STEP_AT_REST
    return int(np.clip(math.ceil(np.max(farthest, initial=0.0) / step), 2, _MOST_MOMENTS))
