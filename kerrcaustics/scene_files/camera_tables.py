"""Tables of scene files: the hole, the camera with its path, and the view.

The docstring of a table has a line for each key; docs/scene_files.md shows them.
"""

from typing import Any, Literal

import msgspec

from kerrcaustics.choices import VelocityName
from kerrcaustics.scene_files.table_values import Inclination, PixelCount, SceneTable, Varied, Vector
from kerrcaustics.scenes.view import Projection


class HoleTable(SceneTable, kw_only=True, frozen=True):
    """The hole.

    spin: at least 0, below 1.
    """

    spin: float


class PlaceAt(SceneTable, kw_only=True, frozen=True):
    """A place of the camera at a time.

    time: the time.
    radius: in units of the mass.
    inclination_deg: angle from the spin axis.
    azimuth_deg: azimuth, which may go beyond 360.
    """

    time: float
    radius: float
    inclination_deg: float = 90.0
    azimuth_deg: float = 0.0


class KeyframesTable(SceneTable, kw_only=True, frozen=True, tag="keyframes", tag_field="kind"):
    """A path through places at times.

    keyframes: places `{time, radius, inclination_deg, azimuth_deg}`, joined by cubic splines with natural ends.
    """

    keyframes: tuple[PlaceAt, ...]


class ExpressionsTable(SceneTable, kw_only=True, frozen=True, tag="expressions", tag_field="kind"):
    """A path by expressions of the time t.

    radius: an expression in `t`; for an observer at infinity `inf`.
    inclination_deg: an expression in `t`.
    azimuth_deg: an expression in `t`.
    """

    radius: float | str
    inclination_deg: float | str = 90.0
    azimuth_deg: float | str = 0.0


class GeodesicTable(SceneTable, kw_only=True, frozen=True, tag="geodesic", tag_field="kind"):
    """A path in free fall, from a place and a velocity.

    radius: at `time`.
    inclination_deg: at `time`.
    azimuth_deg: at `time`.
    velocity: at `time`; `"circular"` keeps the radius constant, even if the orbit is unstable.
    heading_deg: direction in which a circular orbit starts: 0 along increasing φ, 90 toward the spin axis, 180
        backward.
    time: of this place and velocity.
    """

    radius: float
    inclination_deg: Inclination = 90.0
    azimuth_deg: float = 0.0
    velocity: VelocityName | Vector = "circular"
    heading_deg: float = 0.0
    time: float = 0.0


class CsvTable(SceneTable, kw_only=True, frozen=True, tag="csv", tag_field="kind"):
    """A path through the places of a CSV file.

    file: a table whose first line is `time,radius,inclination_deg,azimuth_deg` in any order, joined by splines.
    """

    file: str


PathTable = KeyframesTable | ExpressionsTable | GeodesicTable | CsvTable


class CameraTable(SceneTable, kw_only=True, frozen=True):
    """The camera, or the observer: at a radius, or on a path.

    radius: at time 0; `inf` needs a `view.size`.
    inclination_deg: at time 0; 90 unless given.
    azimuth_deg: at time 0; 0 unless given.
    velocity: a word, or `[v_r, v_theta, v_phi]` measured by the fiducial observer; unless given, `"path"`, the velocity
        of the path, on a path, else circular if there is such an orbit, else fiducial.
    path: a path, in place of the radius.
    """

    radius: float | None = None
    inclination_deg: Inclination | None = None
    azimuth_deg: float | None = None
    velocity: VelocityName | Literal["path"] | Vector | None = None
    path: PathTable | None = None


class ViewTable(SceneTable, kw_only=True, frozen=True):
    """The picture, and where the camera looks; with a size, the screen of an observer.

    width: in pixels; even for a film.
    height: in pixels; even for a film.
    size: full width of the screen of an observer at rest, in units of the mass ([below](#observers)).
    centre: with `size`: `[alpha, beta]` at the middle of the picture; `[0, 0]` unless given.
    field_of_view_deg: from the left edge to the right edge; 90 unless given.
    projection: of a camera; `"pinhole"` unless given.
    look: `"hole"`, the middle of the shadow, unless given; `"forward"`, the direction of motion; or a direction `[r,
        theta, phi]` in the frame of the fiducial observer: `[-1, 0, 0]` points toward the hole.
    tilt_deg: turns the camera clockwise about its line of sight, last of the three.
    yaw_deg: turns it to the right, first of the three; 0 unless given.
    pitch_deg: turns it upward, after the yaw; 0 unless given.
    """

    width: PixelCount = 1280
    height: PixelCount = 720
    size: Varied | None = None
    centre: tuple[Varied, Varied] | None = None
    field_of_view_deg: Varied | None = None
    projection: Projection | None = None
    look: Literal["hole", "forward"] | Vector | None = None
    tilt_deg: Varied = 0.0
    yaw_deg: Varied | None = None
    pitch_deg: Varied | None = None

    def complete(self) -> "ViewTable":
        """The view of a camera, or the screen of an observer, with what is left out."""
        defaults = CAMERA_VIEW if self.size is None else SCREEN
        absent = {key: value for key, value in defaults.items() if getattr(self, key) is None}
        return msgspec.structs.replace(self, **absent)


CAMERA_VIEW: dict[str, Any] = {
    "field_of_view_deg": 90.0,
    "projection": "pinhole",
    "look": "hole",
    "yaw_deg": 0.0,
    "pitch_deg": 0.0,
}
"""Keys of a view that a screen lacks, and their defaults."""
SCREEN: dict[str, Any] = {"centre": (0.0, 0.0)}
"""Keys of a screen that a view of a camera lacks, and their defaults."""
