"""The contents of a scene file, with the tables of its light, film and overlays."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from kerrcaustics.choices import Quality, ShutterShape
from kerrcaustics.scene_files.camera_tables import CameraTable, HoleTable, ViewTable
from kerrcaustics.scene_files.matter_tables import DiskTable, OrbitingSpotsTable, VolumeTable
from kerrcaustics.scene_files.sky_tables import NoSky, SkyTable, StarsTable
from kerrcaustics.scene_files.table_values import Count, GridTable, Inclination, SceneTable, Varied
from kerrcaustics.scenes.colour import Response
from kerrcaustics.scenes.tones import AUTO, Curve

TextPlace = Literal["upper left", "upper centre", "upper right", "lower left", "lower centre", "lower right"]
FilmTime = Annotated[float, Meta(ge=-1e9, le=1e9)]


class FlareTable(SceneTable, kw_only=True, frozen=True):
    """A halo of the lens, or a point spread function.

    share: part of the light in a halo.
    width: of the halo, in pixels of the full-size picture.
    falloff: of the halo.
    file: a point spread function, in place of a halo.
    """

    share: float | None = None
    width: float | None = None
    falloff: float = 3.0
    file: str | None = None


class LightTable(SceneTable, kw_only=True, frozen=True):
    """Physics of the light, and how it becomes a picture.

    exposure: factor applied to the light, or `"auto"` ([below](#exposure)).
    curve: as in `tone_mapped`; `"asinh"` in front of stars, else `"linear"`, unless given.
    softening: of `"asinh"`; 30 unless given.
    beaming: as in `render`.
    colour_shift: as in `render`.
    response: as in `black_body`, or measured curves, `{file = "film.csv"}`: wavelengths in nm and sensitivities for
        red, green and blue.
    delay: as in `render`.
    flare: `[[light.flare]]`, halos of the lens; unless given, in front of stars, a share of 0.2 and a width of 1/240 of
        the height, which `flare = []` removes.
    """

    exposure: Varied = AUTO
    curve: Curve | None = None
    softening: float | None = None
    beaming: bool = False
    colour_shift: bool = False
    response: Response | GridTable = "cie"
    delay: bool = False
    flare: tuple[FlareTable, ...] | None = None

    def complete(self, sky: SkyTable, height: int) -> "LightTable":
        """The light of a scene with defaults filled in: for stars the asinh curve, and a halo."""
        stars = isinstance(sky, StarsTable)
        glare = (FlareTable(share=_GLARE_SHARE, width=_GLARE_WIDTH * height),) if stars else ()
        flare, curve = (glare if self.flare is None else self.flare), ("asinh" if stars else "linear")
        return msgspec.structs.replace(self, flare=flare, curve=self.curve or curve)


# Of the halo of stars: part of their light, and its width as a part of the picture's height.


_GLARE_SHARE, _GLARE_WIDTH = 0.2, 1 / 240


class FilmTable(SceneTable, kw_only=True, frozen=True):
    """The number of frames, and their times.

    frames: number of frames.
    duration: in seconds, in place of `frames`.
    rate: frames per second.
    start: time of the first frame; unless given, that of the keyframes or the CSV file, else 0.
    end: time of the frame that would follow the last; required unless the path has one.
    shutter_deg: motion blur: with 360, each frame is exposed until the next one begins; with 0, and in drafts, the
        exposure is instantaneous.
    shutter_weight: how much each moment counts, or a list of numbers ([motion blur](scenes.md#motion-blur)).
    """

    frames: Count | None = None
    duration: Annotated[float, Meta(gt=0, le=1e5, description="seconds")] | None = None
    rate: Count = 24
    start: FilmTime | None = None
    end: FilmTime | None = None
    shutter_deg: Annotated[float, Meta(ge=0, le=360, description="degrees")] = 0.0
    shutter_weight: ShutterShape | tuple[float, ...] = "box"


class OverlaysTable(SceneTable, kw_only=True, frozen=True):
    """Lines and words drawn onto the picture.

    critical_curves: number of critical curves drawn, from the first.
    curve_colour: of all critical curves; one for each order unless given.
    poles: marks on the images of the two stars on the spin axis, for the same indices as `tracks`.
    shadow_edge: the edge of the shadow.
    tracks: tracks of stars at these θ′, if the camera circles the axis, of index 0 and 1, and higher up to the last
        critical curve drawn.
    labels: names of the lines: true, a list in one place; `"beside"`, beside each curve.
    labels_place: where the list is.
    caption: at most 500 printable characters; fields such as `{radius:.2f}` are filled in from `t`, `radius`,
        `inclination_deg`, `azimuth_deg` and all definitions, in Python's number formats; without a format, to four
        digits.
    caption_place: where the caption is.
    size: letter size, as a percentage of the picture's height; at least 10 pixels.
    colour: of the caption and the list, such as `white` or `#FFD700`.
    """

    critical_curves: Annotated[int, Meta(ge=0, le=10)] = 0
    curve_colour: str = ""
    poles: bool = False
    shadow_edge: bool = False
    tracks: tuple[Inclination, ...] = ()
    labels: bool | Literal["beside"] = False
    labels_place: TextPlace = "lower left"
    caption: str = ""
    caption_place: TextPlace = "upper left"
    size: Annotated[float, Meta(gt=0, le=20)] = 3.2
    colour: str = "white"


class Contents(SceneTable, kw_only=True, frozen=True):
    """All of a scene file.

    hole: the hole.
    camera: the camera.
    title: for readers.
    quality: `"draft"` is for previews ([below](#drafts)).
    definitions: names for numbers and expressions, for use in all expressions: at most 1000, of 100,000 characters in
        all.
    view: the picture.
    sky: the sky.
    disk: a disk.
    volume: matter in space.
    spots: hot spots on orbits of their own, in place of a volume.
    light: the light.
    film: the frames of a film.
    overlays: lines and words.
    """

    hole: HoleTable
    camera: CameraTable
    title: str = ""
    quality: Quality = "normal"
    definitions: dict[str, float | str] = msgspec.field(default_factory=dict)
    view: ViewTable = ViewTable()
    sky: SkyTable = NoSky()
    disk: DiskTable | None = None
    volume: VolumeTable | None = None
    spots: OrbitingSpotsTable | None = None
    light: LightTable = LightTable()
    film: FilmTable | None = None
    overlays: OverlaysTable = OverlaysTable()
