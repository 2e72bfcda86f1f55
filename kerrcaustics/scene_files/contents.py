"""The tables and keys of scene files, as structs. docs/scene_files.md describes each of them."""

from typing import Literal

import msgspec

from kerrcaustics.scenes.checkerboard import COLOURS, GAP_COLOUR
from kerrcaustics.scenes.colour import DAYLIGHT

Velocity = str | tuple[float, float, float]
Quality = Literal["draft", "normal", "high"]
Motion = Literal["circular", "retrograde", "static", "plunging"]
ProjectionName = Literal["pinhole", "fisheye", "equirectangular"]


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
    inclination_deg: float = 90.0
    azimuth_deg: float = 0.0
    velocity: Velocity = "circular"
    heading_deg: float = 0.0
    time: float = 0.0


class CsvTable(SceneTable, kw_only=True, frozen=True, tag="csv", tag_field="kind"):
    """A path through the places of a CSV file."""

    file: str


PathTable = KeyframesTable | ExpressionsTable | GeodesicTable | CsvTable


class CameraTable(SceneTable, kw_only=True, frozen=True):
    """The camera: at a radius, or on a path."""

    radius: float | None = None
    inclination_deg: float | None = None
    azimuth_deg: float | None = None
    velocity: Velocity | None = None
    path: PathTable | None = None


class ViewTable(SceneTable, kw_only=True, frozen=True):
    """The picture, and where the camera looks."""

    width: int = 1280
    height: int = 720
    field_of_view_deg: Varied = 90.0
    projection: ProjectionName = "pinhole"
    look: Velocity = "hole"
    tilt_deg: Varied = 0.0
    yaw_deg: Varied = 0.0
    pitch_deg: Varied = 0.0


class NoSky(SceneTable, kw_only=True, frozen=True, tag="none", tag_field="kind"):
    """A black sky."""


class StarsTable(SceneTable, kw_only=True, frozen=True, tag="stars", tag_field="kind"):
    """Stars and the galactic band; the catalogue of the package, with that of a Tycho-2 file where one is named."""

    band: float = 1.0
    white: float = DAYLIGHT
    galaxy_tilt_deg: float = 25.0
    galaxy_node_deg: float = -60.0
    galaxy_centre_deg: float = 60.0
    tycho2: str | None = None


class CheckerboardTable(SceneTable, kw_only=True, frozen=True, tag="checkerboard", tag_field="kind"):
    """Paint swatches."""

    rows: int = 15
    columns: int = 30
    gap: float = 0.16
    colours: tuple[str, ...] = COLOURS
    gap_colour: str = GAP_COLOUR
    along: Literal["latitude", "longitude"] = "latitude"


class PanoramaTable(SceneTable, kw_only=True, frozen=True, tag="panorama", tag_field="kind"):
    """A picture of the whole sky."""

    file: str


SkyTable = NoSky | StarsTable | CheckerboardTable | PanoramaTable


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
    """A picture."""

    file: str


class SpotsTable(SceneTable, kw_only=True, frozen=True, tag="spots", tag_field="kind"):
    """Hot spots at random places between the rims, their temperatures between two."""

    number: int
    temperature: tuple[float, float] = (4000.0, 10000.0)
    size: float = 0.1
    streak: float = 0.0
    seed: int = 0


class WispsTable(SceneTable, kw_only=True, frozen=True, tag="wisps", tag_field="kind"):
    """Gas of one temperature, kelvin, and uneven depth."""

    peak: float
    depth: float = 1.0
    contrast: float = 1.0
    seed: int = 0


EmissionTable = (
    BlackBodyTable | PowerLawTable | PageThorneTable | SwatchesTable | TextureTable | SpotsTable | WispsTable
)


class DiskTable(SceneTable, kw_only=True, frozen=True):
    """The disk; opacity and slant left out are 1 and true, and for wisps those of the gas itself."""

    inner: float
    outer: float
    emission: EmissionTable
    opacity: float | None = None
    slant: bool | None = None
    motion: Motion = "circular"
    brightness: float = 1.0


class FlareTable(SceneTable, kw_only=True, frozen=True):
    """A halo of the lens, its width in pixels of the whole picture, or a point spread function from a file."""

    share: float | None = None
    width: float | None = None
    falloff: float = 3.0
    file: str | None = None


class LightTable(SceneTable, kw_only=True, frozen=True):
    """Physics of the light, and how it becomes a picture."""

    exposure: Varied = 1.0
    curve: Literal["linear", "asinh"] = "linear"
    softening: float = 30.0
    beaming: bool = False
    colour_shift: bool = False
    response: Literal["cie", "film"] = "cie"
    delay: bool = False
    flare: tuple[FlareTable, ...] = ()


class FilmTable(SceneTable, kw_only=True, frozen=True):
    """The number of frames, and their times."""

    frames: int | None = None
    duration: float | None = None
    rate: int = 24
    start: float | None = None
    end: float | None = None
    shutter_deg: float = 0.0


class OverlaysTable(SceneTable, kw_only=True, frozen=True):
    """Lines and words drawn onto the picture."""

    critical_curves: int = 0
    tracks: tuple[float, ...] = ()
    labels: bool = False
    caption: str = ""


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
    light: LightTable = LightTable()
    film: FilmTable | None = None
    overlays: OverlaysTable = OverlaysTable()


WORDS: dict[str, tuple[str, ...]] = {
    "camera.path.kind": ("keyframes", "expressions", "geodesic", "csv"),
    "sky.kind": ("stars", "checkerboard", "panorama", "none"),
    "disk.emission.kind": ("black-body", "power-law", "page-thorne", "swatches", "texture", "spots", "wisps"),
    "quality": ("draft", "normal", "high"),
    "projection": ("pinhole", "fisheye", "equirectangular"),
    "motion": ("circular", "retrograde", "static", "plunging"),
    "curve": ("linear", "asinh"),
}
"""The words that an entry may be."""
