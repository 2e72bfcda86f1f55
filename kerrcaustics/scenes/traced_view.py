"""Traced views: the map of a picture to the sky and to a disk, made once for any sky."""

import math
from collections.abc import Sequence
from functools import cached_property
from time import perf_counter as clock
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.choices import ShutterShape
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.results.stages import stage, with_stages
from kerrcaustics.scenes.blur import SkyTurn, sky_turn
from kerrcaustics.scenes.disk.crossings import DiskCells, DiskCrossings, Lattice, covered, crossings
from kerrcaustics.scenes.disk.disk import Disk, check_disk, disk_about, outer_rim
from kerrcaustics.scenes.disk.lighting import Looks, disk_light
from kerrcaustics.scenes.disk.veil import Glowing, Matter, veil_over
from kerrcaustics.scenes.motion import shutter_weight
from kerrcaustics.scenes.raster import Raster, check_picture
from kerrcaustics.scenes.rendering import BEAMS, CROSSINGS, ERROR, SKY_RADIUS, STAGES, VISIBLE, Rendering
from kerrcaustics.scenes.scene_checks import check_uses, checked_moment, map_error
from kerrcaustics.scenes.seen_sky import seen_sky, sky_end
from kerrcaustics.scenes.sky import Shifts, Sky
from kerrcaustics.scenes.sky_cells import SkyCells
from kerrcaustics.scenes.sky_light import Parts, sky_light
from kerrcaustics.scenes.star_search import StarSearch
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import flags
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


class DiskMap(NamedTuple):
    """Properties of a disk on which its map depends.

    inner, outer: radii of its rims, M.
    opaque: True if nothing is seen behind it.
    timed: True if travel times are known.
    """

    inner: float
    outer: float
    opaque: bool
    timed: bool

    def serves(self, disk: Any) -> bool:
        """True for a disk that has this map."""
        return isinstance(disk, Disk) and (disk.inner, disk.outer, disk.opaque) == self[:3]


@result("traced-view/1")
class TracedView(Shown):
    """The map of a view to the sky, and to a disk, made once for any sky: the result of `trace_view`."""

    camera: Viewer = quantity("", "", "the camera or the observer", json="", column="")
    view: Raster = quantity("", "", "the part of its sky that is seen")
    visible_fraction: Array | None = quantity("row column", "1", VISIBLE)
    supersampled: int = quantity("", "1", "pixels that were supersampled")
    beams: int = quantity("", "1", BEAMS)
    error: float = quantity("", "1", ERROR)
    seconds: float = quantity("", "s", "time it took")
    crossings: tuple[int, ...] = quantity("crossing", "1", CROSSINGS)
    # Files hold plain tuples alone; the properties below return records.
    _disk: tuple[Any, ...] | None = quantity("", "", "the fields of `disk_map`")
    _cells: list[tuple[Array, ...]] = quantity("", "", "the fields of `disk_cells`")
    _sky_cells: tuple[Array, ...] = quantity("", "", "the fields of `sky_cells`")
    _parts: list[tuple[Any, ...]] = quantity("", "", "the fields of `sky_parts`")
    stages: dict[str, float] = quantity("", "s", STAGES, default=dict)
    sky_radius: float = quantity("", "GM/c^2", SKY_RADIUS, default=math.inf)

    @with_stages
    def show(
        self,
        sky: Sky | None = None,
        *,
        disk: Disk | None = None,
        volume: Glowing | None = None,
        beaming: bool = False,
        colour_shift: bool = False,
        delay: bool = False,
        time: float = 0.0,
        turn: float = 0.0,
        turn_weight: ShutterShape | Sequence[float] = "box",
        draft: bool = False,
    ) -> Rendering:
        """A sky, a disk and a volume as they are seen in this view; parameters as for `render`.

        disk: the disk that the view was traced with, or another one between the same rims and as opaque; turn: angle
        (radians) by which the sky turns about the spin axis during the exposure, half of it on either side;
        turn_weight: weight of the moments of the exposure, as for `ShutterMotion`; draft: True for a volume in long
        steps.
        """
        flags(beaming=beaming, colour_shift=colour_shift, delay=delay, draft=draft)
        began, disk = clock(), disk_about(disk, self.camera)
        matter, shifts = Matter(disk, volume), Shifts(beaming, colour_shift)
        check_uses(matter.exists, delay)
        light, transmission = np.zeros((*self.view.shape, 3), np.float32), None
        if sky is not None:
            light = self._sky_light(sky, shifts, sky_turn(sky, turn, shutter_weight("turn_weight", turn_weight)))
        if matter.exists:
            cells = () if disk is None else self._cells_of(disk, delay)
            looks = Looks(self.camera.spin, beaming, colour_shift, delay, checked_moment(time))
            veil = veil_over(self.camera, self.view, volume, shifts, len(cells), (looks.time, delay), draft)
            with stage("disk_light"):
                glow, transmission = disk_light(disk, cells, self.view.shape, looks, veil)
            light = light * transmission[..., None] + glow
        return Rendering(
            camera=self.camera,
            view=self.view,
            light=light,
            visible_fraction=self.visible_fraction,
            supersampled=self.supersampled,
            beams=self.beams,
            seconds=self.seconds + clock() - began,
            crossings=self.crossings,
            transmission=transmission,
            error=self.error,
            stages=self.stages,
            sky_radius=self.sky_radius,
        )

    def _cells_of(self, disk: Disk, delay: bool) -> tuple[DiskCells, ...]:
        """Cells that see a disk; ValueError unless the view was traced for it."""
        if self.disk_map is None or not self.disk_map.serves(disk):
            raise ValueError("Argument `disk` must have the rims that the view was traced with, and be as opaque.")
        if delay and not self.disk_map.timed:
            raise ValueError("Argument `delay` needs a view that was traced with it.")
        return self.disk_cells

    def _sky_light(self, sky: Sky, shifts: Shifts, turn: SkyTurn) -> Float[Array, "height width 3"]:
        if self.visible_fraction is None:
            raise ValueError("Argument `sky` needs a view that was traced with it.")
        mapped, end = (self.sky_cells, self.sky_parts), sky_end(self.camera, self.sky_radius)
        return sky_light(self.camera, self.view, sky, *mapped, lambda: self.star_search, shifts, turn, end)

    @property
    def disk_map(self) -> DiskMap | None:
        """Properties of the disk on which the map depends; None without a disk."""
        return None if self._disk is None else DiskMap(*self._disk)

    @property
    def disk_cells(self) -> tuple[DiskCells, ...]:
        """Cells of the picture that see the disk, crossing by crossing."""
        return tuple(DiskCells(*cells) for cells in self._cells)

    @property
    def sky_cells(self) -> SkyCells:
        """Cells of the picture that see the sky; of a view with a sky."""
        return SkyCells(*self._sky_cells)

    @property
    def sky_parts(self) -> list[Parts]:
        """Parts of supersampled pixels that see the sky."""
        return [Parts(*part) for part in self._parts]

    @cached_property
    def star_search(self) -> StarSearch:
        """The search for images of stars, for any catalogue; of a view with a sky."""
        assert self.visible_fraction is not None
        end = sky_end(self.camera, self.sky_radius)
        return StarSearch(self.camera, self.view, self.sky_cells, self.visible_fraction, end=end)


@usual_warnings
@with_stages
@with_progress
def trace_view(
    camera: Viewer,
    view: Raster,
    *,
    sky: bool = True,
    disk: Disk | None = None,
    delay: bool = False,
    quality: str = "normal",
    sky_radius: float = math.inf,
    progress: Progress | bool | None = None,
) -> TracedView:
    """The map of a view, for `TracedView.show`: for films, where the sky moves and the camera does not.

    Parameters
    ----------
    camera : Camera or Observer
    view : View or Screen
        As for `render`.
    sky : bool
        Trace the sky.
    disk : Disk, optional
        Its rims and its opacity count.
    delay : bool
        Compute the travel time from the disk.
    quality : str
        As for `render`.
    sky_radius : float
        As for `render`.
    progress : callable or bool, optional
        As for `caustics`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> view = kc.pictures.View.toward_hole(camera, width=64, height=36, field_of_view=1.0)
    >>> traced = kc.pictures.trace_view(camera, view)
    >>> traced.show(kc.skies.Checkerboard()).light.shape
    (36, 64, 3)
    """
    flags(sky=sky, delay=delay)
    began, disk = clock(), disk_about(disk, camera)
    check_picture(camera, view)
    check_uses(disk is not None, delay, sky, sky_radius)
    close, end = map_error(quality), sky_end(camera, sky_radius, outer_rim(disk))
    hidden, disk_map, plane = np.zeros(view.shape, bool), None, DiskCrossings((), ())
    if disk is not None:
        plane = _crossings(camera, view, disk, delay, quality)
        disk_map = DiskMap(disk.inner, disk.outer, disk.opaque, delay)
        if disk.opaque:
            hidden = covered(plane.cells, view.shape, disk.inner, disk.outer)
    visible = seen_sky(camera, view, close, hidden, end=end) if sky else None
    return TracedView(
        camera=camera,
        view=view,
        visible_fraction=visible and visible.visible_fraction,
        supersampled=visible.supersampled if visible else 0,
        beams=sum(plane.beams) + (visible.beams if visible else 0),
        error=visible.error if visible else math.nan,
        seconds=clock() - began,
        crossings=plane.beams,
        _disk=disk_map and tuple(disk_map),
        _cells=[tuple(cells) for cells in plane.cells],
        _sky_cells=tuple(visible.cells) if visible else (),
        _parts=[tuple(part) for part in visible.parts] if visible else [],
        sky_radius=end.radius,
    )


@stage("disk_map")
def _crossings(camera: Viewer, view: Raster, disk: Disk, delay: bool, quality: str) -> DiskCrossings:
    check_disk(disk, camera.spin)
    lattice = (Lattice.draft if quality == "draft" else Lattice)(camera, view, delay)
    return crossings(lattice, disk.inner, disk.outer, disk.opaque)
