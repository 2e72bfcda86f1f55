"""A scene from a file: its frames, and all that they depend on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, get_args

import msgspec
import numpy as np

from kerrcaustics.choices import Quality
from kerrcaustics.scene_files.angle_remarks import angle_remarks
from kerrcaustics.scene_files.builders import add_glare, point_spread, sky_radius_of
from kerrcaustics.scene_files.camera_tables import GeodesicTable
from kerrcaustics.scene_files.cameras import CameraPath, camera_path
from kerrcaustics.scene_files.contents import Contents, FilmTable, OverlaysTable
from kerrcaustics.scene_files.exposure import (
    Development,
    ExposureOverTime,
    developed,
    exposure_of,
    is_auto,
    keyframes,
)
from kerrcaustics.scene_files.matter import SceneMatter
from kerrcaustics.scene_files.named_files import named_files
from kerrcaustics.scene_files.overrides import with_overrides
from kerrcaustics.scene_files.renderer import rendered
from kerrcaustics.scene_files.sky_tables import NoSky
from kerrcaustics.scene_files.validation import check_contents, file_errors, reject, table_errors
from kerrcaustics.scene_files.view_over_time import ViewOverTime
from kerrcaustics.scenes.motion import ShutterMotion
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.rendering import Rendering
from kerrcaustics.shapes import Float, UInt8
from kerrcaustics.spacetime.checks import one_of, quoted, real_number, whole_number
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.toml_files import as_struct, not_finite, read_toml

Array = np.ndarray

_MAY_BE_INFINITE = ("camera.radius", "camera.path.radius")
# Number of a film's frames that are checked before any is drawn.
_CHECKED = 100
# Width, pixels, of the frames from whose light a film has its exposures, as of a preview.
_SMALL = 320
_BLACK = (
    "The scene has neither a sky nor a disk nor a volume, and its picture is black: "
    '[sky] with kind = "stars" gives it one.'
)


@dataclass(frozen=True)
class SceneFile:
    r"""A scene: one picture, or the frames of a film.

    Parameters
    ----------
    contents : Contents
        The tables of the file.
    folder : Path
        The folder of the files that it names.
    name : str
        Name of the file, for error messages.
    files : tuple of (str, str)
        Files that it names, each with the SHA-256 of its bytes.

    Raises
    ------
    ValueError
        If the file cannot be read or an entry is invalid; the message names the key.

    Notes
    -----
    `SceneFile.read` and `read_scene` make one. For an invalid file they raise a ValueError of one line that names the
    file, the key by its path and what it must be. A pickled scene has its file's contents alone.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> text = 'hole = {spin = 0.9}\ncamera = {radius = 10}\nsky = {kind = "checkerboard"}'
    >>> _ = open("scene.toml", "w").write(text)
    >>> kc.SceneFile.read("scene.toml").size
    (1280, 720)
    """

    contents: Contents
    folder: Path
    name: str
    files: tuple[tuple[str, str], ...] = ()

    @classmethod
    def read(cls, path: str | Path, overrides: Sequence[str] = ()) -> "SceneFile":
        """The scene in a TOML file. overrides: entries that replace those of the file, such as "camera.radius=5"."""
        path = Path(path)
        table = read_toml(path)
        with file_errors(str(path)):
            table = with_overrides(table, overrides)
            for entry, value in not_finite(table):
                if value != math.inf or entry not in _MAY_BE_INFINITE:
                    reject(entry, "be a finite number", value)
            contents = as_struct(table, Contents, path)
            check_contents(contents)
            light = contents.light.complete(contents.sky, contents.view.height)
            contents = msgspec.structs.replace(contents, view=contents.view.complete(), light=light)
            folder = path.absolute().parent
            files = named_files(contents, folder)
            scene = cls(contents, folder, str(path), files)
            scene._check()
        return scene

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the contents without cached values."""
        return SceneFile, (self.contents, self.folder, self.name, self.files)

    def __repr__(self) -> str:
        """Return a line with file, size and frames."""
        return f"<SceneFile {self.name}: {self.size[0]} x {self.size[1]} pixels, {self.frames} frames>"

    @property
    def is_film(self) -> bool:
        """True if the file has a table [film]."""
        return self.contents.film is not None

    @property
    def frames(self) -> int:
        """Number of frames: 1 for a picture."""
        film = self._film
        return film.frames or max(round((film.duration or 0.0) * film.rate), 1)

    @property
    def rate(self) -> int:
        """Frames per second."""
        return self._film.rate

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self.contents.view.width, self.contents.view.height

    def resized(self, width: int, height: int) -> "SceneFile":
        """The scene in another size, pixels; the width of the flare, in pixels, is scaled with it."""
        contents, scale = self.contents, width / self.size[0]
        with file_errors(self.name):
            replaced = msgspec.structs.replace
            view = replaced(contents.view, width=width, height=height)
            halos = contents.light.flare
            flare = halos and tuple(
                halo if halo.width is None else replaced(halo, width=scale * halo.width) for halo in halos
            )
            contents = replaced(contents, view=view, light=replaced(contents.light, flare=flare))
            scene = SceneFile(contents, self.folder, self.name, self.files)
            scene._check()
        return scene

    @property
    def quality(self) -> str:
        """The quality in the file."""
        return self.contents.quality

    @property
    def span(self) -> tuple[float, float]:
        """Times of the first frame and of the frame after the last, coordinate time of the hole."""
        low, high = self._path.motion.span if self.contents.camera.path is not None else (0.0, 0.0)
        film = self._film
        start = film.start if film.start is not None else low if math.isfinite(low) else 0.0
        end = film.end if film.end is not None else high if math.isfinite(high) else start
        return start, end

    @property
    def step(self) -> float:
        """Time from one frame to the next."""
        return (self.span[1] - self.span[0]) / self.frames

    def moment(self, number: int) -> float:
        """Time of a frame, counted from 0, in the middle of its exposure."""
        number = whole_number("number", number, 0, self.frames - 1)
        return self.span[0] + self.step * number

    @property
    def remarks(self) -> tuple[str, ...]:
        """Lines on entries that the author may not have intended."""
        black = isinstance(self.contents.sky, NoSky) and not self.matter.exists
        return (*((_BLACK,) if black else ()), *angle_remarks(self.contents, self._path.motion))

    def record(self) -> dict[str, Any]:
        """Everything on which the frames depend, as plain data for JSON; named files by their hashes."""
        entry = msgspec.json.decode(msgspec.json.encode(self.contents))
        for key in ("title", "film"):
            entry.pop(key)
        shutter = {"shutter_deg": self._film.shutter_deg, "shutter_weight": self._film.shutter_weight}
        frames = {"frames": self.frames, "span": list(self.span), **shutter}
        return {"schema": "kerrcaustics/scene-file/1", **entry, "shown": frames, "files": dict(self.files)}

    def camera(self, time: float) -> Viewer:
        """The camera, or the observer, at a time."""
        return self._camera_view(time)[0]

    def azimuth(self, time: float) -> float:
        """Azimuth phi (radians) of the camera at a time, by which sky and disk are turned back."""
        with file_errors(self.name):
            return self._path.camera(time)[1].phi

    def view(self, time: float, scale: float = 1.0) -> Raster:
        """The view, or the screen, at a time; scale: of the picture's width and height."""
        return self._camera_view(time, scale)[1]

    def rendering(self, number: int, *, quality: str | None = None, scale: float = 1.0) -> Rendering:
        """A frame in linear light.

        Parameters
        ----------
        number : int
            From 0 to `frames` - 1.
        quality : str, optional
            "draft", "normal" or "high"; if omitted, the quality in the file.
        scale : float
            Factor of width and height.
        """
        quality = self.quality if quality is None else quality
        one_of("quality", quality, get_args(Quality))
        time = self.moment(number)
        camera, view = self._camera_view(time, scale)
        with file_errors(self.name):
            phi = self._path.camera(time)[1].phi
            contents = self.matter.frame(time, phi, sky_radius_of(self.contents, camera))
            return rendered(camera, view, contents, self._motion(time, phi, scale), quality)

    def _motion(self, time: float, phi: float, scale: float) -> ShutterMotion | None:
        """The motion during the exposure of a frame; phi: azimuth of the camera in its middle."""
        low, high = self._path.motion.span
        # A path is not defined before its first time, at which films begin.
        half = min(self.step * self._film.shutter_deg / 720, time - low, high - time)
        if not half > 0:
            return None
        first, last = time - half, time + half
        (opened, view), (closed, view_at_end) = (self._camera_view(moment, scale) for moment in (first, last))
        azimuths = self._path.camera(first)[1].phi - phi, self._path.camera(last)[1].phi - phi
        return ShutterMotion(
            (opened, closed), (view, view_at_end), azimuths, (first - time, last - time), self._film.shutter_weight
        )

    def light(self, rendering: Rendering, scale: float = 1.0) -> Float[Array, "height width 3"]:
        """Linear light of a frame, with the flare of the lens; scale: that of the picture."""
        return np.asarray(add_glare(rendering.light, self.contents.light.flare or (), self.folder, scale), np.float32)

    def exposure(self, number: int, light: Float[Array, "height width 3"], alone: bool = False) -> float:
        """The exposure of a frame of linear light, from the file or from the light.

        The light is that of the keyframes of a film; alone: True for that of the frame itself.
        """
        if not self._by_light:
            with file_errors(self.name):
                return self._exposure.exposure_at(self._path.values_at(self.moment(number)))
        by_frame = alone or self.frames == 1
        return exposure_of(light, self.contents.light) if by_frame else self._exposed.exposure(number, light)

    def with_exposures(self) -> "SceneFile":
        """The scene with automatic exposures of its film as values at times.

        They come from the light of nine frames, drafts 320 pixels wide. A film computes them once, before other
        processes draw its frames. A single picture is unchanged.
        """
        return self._exposed if self._by_light and self.frames > 1 else self

    @cached_property
    def _exposed(self) -> "SceneFile":
        scale = min(_SMALL / self.size[0], 1.0)

        def light(number: int) -> Array:
            return self.light(self.rendering(number, quality="draft", scale=scale), scale)

        exposure = keyframes(self.frames, light, self.moment, self.contents.light)
        table = msgspec.structs.replace(self.contents.light, exposure=exposure)
        return replace(self, contents=msgspec.structs.replace(self.contents, light=table))

    @property
    def _by_light(self) -> bool:
        return is_auto(self.contents.light)

    @cached_property
    def _exposure(self) -> ExposureOverTime:
        return ExposureOverTime(self.contents.light.exposure, self._path)

    def development(self, number: int, rendering: Rendering, scale: float = 1.0, *, alone: bool = False) -> Development:
        """The picture of a frame that was rendered, without overlays: flare, exposure, tone curve.

        alone: True for an exposure from this frame alone.
        """
        light = self.light(rendering, scale)
        with file_errors(self.name):
            return developed(light, self.contents.light, self.exposure(number, light, alone))

    def developed(self, number: int, rendering: Rendering, scale: float = 1.0) -> UInt8[Array, "height width 3"]:
        """The picture of a frame that was rendered: flare, exposure, tone curve, overlays."""
        return self.with_overlays(number, rendering, self.development(number, rendering, scale).picture)

    def with_overlays(
        self, number: int, rendering: Rendering, picture: UInt8[Array, "height width 3"]
    ) -> UInt8[Array, "height width 3"]:
        """A picture of a frame with its overlays."""
        if not self._overlaid:
            return picture
        from kerrcaustics.scene_files.overlays import overlaid

        with file_errors(self.name):
            return overlaid(picture, self.contents.overlays, rendering, self._path.values_at(self.moment(number)))

    @property
    def _overlaid(self) -> bool:
        """True if pictures have overlays: only then Matplotlib is imported."""
        return self.contents.overlays != OverlaysTable()

    def picture(self, number: int, *, quality: str | None = None, scale: float = 1.0) -> UInt8[Array, "height width 3"]:
        """A frame as a picture (height, width, 3) of bytes; parameters as for `rendering`."""
        return self.developed(number, self.rendering(number, quality=quality, scale=scale), scale)

    @cached_property
    def _film(self) -> FilmTable:
        return self.contents.film or FilmTable(frames=1)

    @cached_property
    def _path(self) -> CameraPath:
        film = self.contents.film
        span = None
        if film is not None and (film.start is not None or film.end is not None):
            path = self.contents.camera.path
            first = path.time if isinstance(path, GeodesicTable) else 0.0
            start = first if film.start is None else film.start
            span = start, start if film.end is None else film.end
        return camera_path(self.contents, self.folder, span)

    @cached_property
    def matter(self) -> SceneMatter:
        """The sky, the disk and the matter in space."""
        return SceneMatter(self.contents, self.folder, self.files, self._path)

    @cached_property
    def views(self) -> ViewOverTime:
        """The view, or the screen, over time."""
        return ViewOverTime(self.contents.view, self._path)

    def _camera_view(self, time: float, scale: float = 1.0) -> tuple[Viewer, Raster]:
        if not math.isfinite(real_number("time", time)):
            raise ValueError(f"Argument `time` must be a finite number, but is {quoted(time)}.")
        if not 0 < real_number("scale", scale) <= 16:
            raise ValueError(f"Argument `scale` must be more than 0 and at most 16, but is {quoted(scale)}.")
        with file_errors(self.name):
            camera = self._path.camera(time)[0]
            return camera, self.views.raster(camera, time, scale)

    def _check(self) -> None:
        """Build everything that costs little, so that errors are raised before any ray is traced."""
        start, end = self.span
        if not (end > start or (self.frames == 1 and end == start)):
            reject("film.end", f"be given, and be later than film.start ({start:g})", end)
        _ = self.matter.sky
        for i, halo in enumerate(self.contents.light.flare or ()):
            with table_errors(f"light.flare[{i}]"):
                point_spread(halo, self.folder, 1.0)
        _ = self.matter.disk
        for number in sorted({*range(0, self.frames, max(self.frames // _CHECKED, 1)), self.frames - 1}):
            self._check_frame(self.moment(number))
        if self._overlaid:
            from kerrcaustics.scene_files.overlays import check_overlays

            check_overlays(self.contents.overlays, self._path, self.span)

    def _check_frame(self, time: float) -> None:
        camera = self._path.camera(time)[0]
        sky_radius_of(self.contents, camera)
        self.views.raster(camera, time, 1.0, trial=True)
        self.matter.volume(time)
        exposure = 1.0 if self._by_light else self._exposure.exposure_at(self._path.values_at(time))
        developed(np.zeros((1, 1, 3), np.float32), self.contents.light, exposure)
