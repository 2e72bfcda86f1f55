"""The sky, the disk and the matter in space of a scene file."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from kerrcaustics.scene_files.builders import brightness_of, disk_of, orbiting_spots_of, response_of, sky_of
from kerrcaustics.scene_files.cameras import CameraPath
from kerrcaustics.scene_files.contents import Contents
from kerrcaustics.scene_files.renderer import FrameContents
from kerrcaustics.scene_files.validation import SceneError
from kerrcaustics.scene_files.volumes import values_in, volume_of
from kerrcaustics.scenes.colour import ResponseLike
from kerrcaustics.scenes.disk.turned import turned_disk, turned_volume
from kerrcaustics.scenes.disk.veil import Glowing, Matter
from kerrcaustics.scenes.turned_sky import TurnedSky


@dataclass(frozen=True)
class SceneMatter:
    """The sources of light of a scene."""

    # The tables of the file.
    contents: Contents
    # The folder of the files that it names.
    folder: Path
    # These files, each with the SHA-256 of its bytes.
    files: tuple[tuple[str, str], ...]
    # The path of the camera, whose time and place the values of a volume may depend on.
    path: CameraPath

    @property
    def sky(self) -> Any:
        """The sky; None for a black sky."""
        return sky_of(self.contents.sky, self.folder, self.files, self._response)

    @cached_property
    def disk(self) -> Any:
        """The disk, or None."""
        table = self.contents.disk
        if table is None:
            return None
        brightness = brightness_of(table, self.contents.sky)
        return disk_of(table, brightness, self.contents.hole.spin, self.folder, self.files, self._response)

    def volume(self, time: float) -> Glowing | None:
        """The matter in space at a time, or the spots in its place."""
        table, contents = self.contents.volume, self.contents
        if contents.spots is not None:
            if table is not None:
                raise SceneError("spots must not stand beside volume.")
            return orbiting_spots_of(contents.spots, contents.hole.spin, self._response)
        if table is None:
            return None
        values = values_in(table, self.path, time)
        brightness, spin = brightness_of(table, contents.sky), contents.hole.spin
        return volume_of(table, values, brightness, spin, self.folder, self.files, self._response)

    @property
    def exists(self) -> bool:
        """True if there is a disk, a volume or spots."""
        return any(table is not None for table in (self.contents.disk, self.contents.volume, self.contents.spots))

    def frame(self, time: float, phi: float, sky_radius: float) -> FrameContents:
        """The scene at a time, turned back by the azimuth phi of the camera."""
        sky, volume = self.sky, self.volume(time)
        if sky is not None and phi != 0:
            sky = TurnedSky(sky, -phi)
        disk = None if self.disk is None else turned_disk(self.disk, -phi)
        matter = Matter(disk, None if volume is None else turned_volume(volume, -phi))
        return FrameContents(sky, sky_radius, matter, self.contents.light, time)

    @property
    def _response(self) -> ResponseLike:
        return response_of(self.contents.light.response, self.folder, self.files)
