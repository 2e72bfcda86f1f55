"""The tables and keys of scene files, as structs. docs/scene_files.md describes each of them."""

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from kerrcaustics.choices import Quality, ShutterShape, VelocityName
from kerrcaustics.scenes.checkerboard import COLOURS, GAP_COLOUR, Along
from kerrcaustics.scenes.colour import DAYLIGHT, Response
from kerrcaustics.scenes.disk.disk import DiskMotion
from kerrcaustics.scenes.disk.wisps import TemperatureLaw
from kerrcaustics.scenes.raster import MOST_PIXELS
from kerrcaustics.scenes.star_field import BAND, NEBULAE
from kerrcaustics.scenes.tones import AUTO, Curve
from kerrcaustics.scenes.view import Projection

Vector = tuple[float, float, float]
Inclination = Annotated[float, Meta(ge=0, le=180, description="degrees")]
PixelCount = Annotated[int, Meta(ge=1, le=MOST_PIXELS)]
Count = Annotated[int, Meta(ge=1, le=1_000_000)]
Seed = Annotated[int, Meta(ge=0)]
TextPlace = Literal["upper left", "upper centre", "upper right", "lower left", "lower centre", "lower right"]
FilmTime = Annotated[float, Meta(ge=-1e9, le=1e9)]


class SceneTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """A table of a scene file."""


class HoleTable(SceneTable, kw_only=True, frozen=True):
    """The hole."""

    spin: float


class ValueAt(SceneTable, kw_only=True, frozen=True):
    """A value at a time."""

    time: float
    value: float


Varied = float | str | tuple[ValueAt, ...]
"""A number, an expression of t, or values at times, which a spline joins."""


class PlaceAt(SceneTable, kw_only=True, frozen=True):
    """A place of the camera at a time."""

    time: float
    radius: float
    inclination_deg: float = 90.0
    azimuth_deg: float = 0.0


class KeyframesTable(SceneTable, kw_only=True, frozen=True, tag="keyframes", tag_field="kind"):
    """A path through places at times."""

    keyframes: tuple[PlaceAt, ...]


class ExpressionsTable(SceneTable, kw_only=True, frozen=True, tag="expressions", tag_field="kind"):
    """A path by expressions of the time t."""

    radius: float | str
    inclination_deg: float | str = 90.0
    azimuth_deg: float | str = 0.0


class GeodesicTable(SceneTable, kw_only=True, frozen=True, tag="geodesic", tag_field="kind"):
    """A path in free fall, from a place and a velocity."""

    radius: float
    inclination_deg: Inclination = 90.0
    azimuth_deg: float = 0.0
    velocity: VelocityName | Vector = "circular"
    heading_deg: float = 0.0
    time: float = 0.0


class CsvTable(SceneTable, kw_only=True, frozen=True, tag="csv", tag_field="kind"):
    """A path through the places of a CSV file."""

    file: str


PathTable = KeyframesTable | ExpressionsTable | GeodesicTable | CsvTable


class CameraTable(SceneTable, kw_only=True, frozen=True):
    """The camera, or the observer: at a radius, or on a path."""

    radius: float | None = None
    inclination_deg: Inclination | None = None
    azimuth_deg: float | None = None
    velocity: VelocityName | Literal["path"] | Vector | None = None
    path: PathTable | None = None


class ViewTable(SceneTable, kw_only=True, frozen=True):
    """The picture, and where the camera looks; with a size, the screen of an observer."""

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
        """The view of a camera, or the screen of an observer, with defaults filled in."""
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


class NoSky(SceneTable, kw_only=True, frozen=True, tag="none", tag_field="kind"):
    """A black sky."""


class PictureTable(SceneTable, kw_only=True, frozen=True):
    """A picture of the whole sky, as photographs have it, or a chart; orientation: to the right, up, clockwise."""

    file: str
    mirror: bool = False
    orientation_deg: float | Vector = 0.0
    brightness: float = 1.0
    spectrum: float | tuple[float | tuple[float, float], ...] | None = None


class NebulaeTable(PictureTable, kw_only=True, frozen=True):
    """A picture beside the stars, of the hole's sky or of the stars' own Galaxy."""

    brightness: float = NEBULAE
    frame: Literal["hole", "galaxy"] = "hole"


class StarsTable(SceneTable, kw_only=True, frozen=True, tag="stars", tag_field="kind"):
    """Stars and the galactic band; the catalogue of the package, with that of a Tycho-2 file where one is named."""

    band: float = BAND
    white: float = DAYLIGHT
    galaxy_tilt_deg: float = 25.0
    galaxy_node_deg: float = -60.0
    galaxy_centre_deg: float = 60.0
    tycho2: str | None = None
    nebulae: NebulaeTable | None = None
    radius: float | None = None


class CheckerboardTable(SceneTable, kw_only=True, frozen=True, tag="checkerboard", tag_field="kind"):
    """Paint swatches."""

    rows: int = 15
    columns: int = 30
    gap: float = 0.16
    colours: tuple[str, ...] = COLOURS
    gap_colour: str = GAP_COLOUR
    along: Along = "latitude"
    radius: float | None = None


class PanoramaTable(PictureTable, kw_only=True, frozen=True, tag="panorama", tag_field="kind"):
    """A picture of the whole sky alone."""

    radius: float | None = None


SkyTable = StarsTable | CheckerboardTable | PanoramaTable | NoSky


class BlackBodyTable(SceneTable, kw_only=True, frozen=True, tag="black-body", tag_field="kind"):
    """A black body of a single temperature, kelvin."""

    peak: float


class PowerLawTable(SceneTable, kw_only=True, frozen=True, tag="power-law", tag_field="kind"):
    """A temperature that falls with the radius."""

    peak: float
    exponent: float = 0.75
    at: float = 10.0


class PageThorneTable(SceneTable, kw_only=True, frozen=True, tag="page-thorne", tag_field="kind"):
    """Steady accretion."""

    peak: float


class SwatchesTable(SceneTable, kw_only=True, frozen=True, tag="swatches", tag_field="kind"):
    """Paint."""

    rows: int = 5
    columns: int = 40
    gap: float = 0.16
    colours: tuple[str, ...] = COLOURS
    gap_colour: str = GAP_COLOUR


class TextureTable(SceneTable, kw_only=True, frozen=True, tag="texture", tag_field="kind"):
    """A picture, as it is seen from the south, or with mirror from the north."""

    file: str
    mirror: bool = False


class SpotsTable(SceneTable, kw_only=True, frozen=True, tag="spots", tag_field="kind"):
    """Hot spots at random places between the rims, their temperatures between two."""

    number: Count
    temperature: tuple[float, float] = (4000.0, 10000.0)
    size: float = 0.1
    streak: float = 0.0
    fade: Literal["linear", "quadratic"] = "linear"
    brightness: tuple[float, float] = (1.0, 1.0)
    retrograde: Annotated[float, Meta(ge=0, le=1)] = 0.0
    seed: Seed = 0


class WispsTable(SceneTable, kw_only=True, frozen=True, tag="wisps", tag_field="kind"):
    """Gas of uneven depth; peak, kelvin."""

    peak: float
    depth: float = 1.0
    contrast: float = 1.0
    seed: Seed = 0
    law: TemperatureLaw = "black-body"


EmissionTable = (
    BlackBodyTable | PowerLawTable | PageThorneTable | SwatchesTable | TextureTable | SpotsTable | WispsTable
)


class DiskTable(SceneTable, kw_only=True, frozen=True):
    """The disk; opacity and slant left out are 1 and true, and for wisps those of the gas itself.

    brightness left out is that of a disk that shows before the sky. inner may be the innermost stable circular orbit.
    """

    inner: float | Literal["isco"]
    outer: float
    emission: EmissionTable
    opacity: float | None = None
    slant: bool | None = None
    motion: DiskMotion = "circular"
    brightness: float | None = None


class GridTable(SceneTable, kw_only=True, frozen=True):
    """Numbers in a file: a grid in space, an array in a .npy file, or curves in a text file."""

    file: str


Law = float | str | GridTable
"""A number, an expression of r, theta and phi, or a grid."""


class VolumeTable(SceneTable, kw_only=True, frozen=True):
    """Matter in space; motion: a word, or an expression of r and theta.

    brightness left out is that of a volume that shows before the sky.
    """

    inner: float
    outer: float
    density: Law
    temperature: Law
    scale: float | None = None
    motion: str = "circular"
    brightness: float | None = None
    colour: str | GridTable | None = None


class OrbitingSpotsTable(SceneTable, kw_only=True, frozen=True):
    """Hot spots on circular orbits of their own, at random between pairs of numbers; in place of a volume."""

    number: Count
    inner: float
    outer: float
    inclination_deg: tuple[float, float] = (0.0, 0.0)
    node_deg: tuple[float, float] = (0.0, 360.0)
    temperature: tuple[float, float] = (4000.0, 10000.0)
    size: float = 0.1
    streak: float = 0.0
    fade: Literal["linear", "quadratic"] = "linear"
    brightness: tuple[float, float] = (1.0, 1.0)
    retrograde: Annotated[float, Meta(ge=0, le=1)] = 0.0
    seed: Seed = 0


class FlareTable(SceneTable, kw_only=True, frozen=True):
    """A halo of the lens, its width in pixels of the whole picture, or a point spread function from a file."""

    share: float | None = None
    width: float | None = None
    falloff: float = 3.0
    file: str | None = None


class LightTable(SceneTable, kw_only=True, frozen=True):
    """Physics of the light, and how it becomes a picture; exposure may be "auto"."""

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


# Part of the light of stars in their default halo.
_GLARE_SHARE = 0.2
# Width of this halo, as a part of the picture's height.
_GLARE_WIDTH = 1 / 240


class FilmTable(SceneTable, kw_only=True, frozen=True):
    """The number of frames, and their times."""

    frames: Count | None = None
    duration: Annotated[float, Meta(gt=0, le=1e5, description="seconds")] | None = None
    rate: Count = 24
    start: FilmTime | None = None
    end: FilmTime | None = None
    shutter_deg: Annotated[float, Meta(ge=0, le=360, description="degrees")] = 0.0
    shutter_weight: ShutterShape | tuple[float, ...] = "box"


class OverlaysTable(SceneTable, kw_only=True, frozen=True):
    """Lines and words drawn onto the picture."""

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
    """All of a scene file."""

    hole: HoleTable
    camera: CameraTable
    title: str = ""
    quality: Quality = "normal"
    definitions: dict[str, float | str] = {}
    view: ViewTable = ViewTable()
    sky: SkyTable = NoSky()
    disk: DiskTable | None = None
    volume: VolumeTable | None = None
    spots: OrbitingSpotsTable | None = None
    light: LightTable = LightTable()
    film: FilmTable | None = None
    overlays: OverlaysTable = OverlaysTable()
