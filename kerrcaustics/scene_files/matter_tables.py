"""Tables of scene files: the disk and what makes it shine, matter in space, and hot spots."""

from typing import Annotated, Literal

from msgspec import Meta

from kerrcaustics.scene_files.table_values import Count, GridTable, SceneTable, Seed
from kerrcaustics.scenes.checkerboard import COLOURS, GAP_COLOUR
from kerrcaustics.scenes.disk.disk import DiskMotion
from kerrcaustics.scenes.disk.wisps import TemperatureLaw


class BlackBodyTable(SceneTable, kw_only=True, frozen=True, tag="black-body", tag_field="kind"):
    """A black body of a single temperature.

    peak: temperature everywhere, in kelvin; it looks flat without `light.beaming` and `light.colour_shift`.
    """

    peak: float


class PowerLawTable(SceneTable, kw_only=True, frozen=True, tag="power-law", tag_field="kind"):
    """A temperature that falls with the radius.

    peak: temperature at the radius `at`, in kelvin.
    exponent: of the fall with the radius.
    at: radius of the temperature `peak`.
    """

    peak: float
    exponent: float = 0.75
    at: float = 10.0


class PageThorneTable(SceneTable, kw_only=True, frozen=True, tag="page-thorne", tag_field="kind"):
    """Steady accretion.

    peak: highest temperature, in kelvin.
    """

    peak: float


class SwatchesTable(SceneTable, kw_only=True, frozen=True, tag="swatches", tag_field="kind"):
    """Paint.

    rows: swatches from rim to rim.
    columns: swatches round the hole.
    gap: part of a swatch's period that is a gap.
    colours: `#rrggbb`, from the inner rim to the outer one.
    gap_colour: of the gaps.
    """

    rows: int = 5
    columns: int = 40
    gap: float = 0.16
    colours: tuple[str, ...] = COLOURS
    gap_colour: str = GAP_COLOUR


class TextureTable(SceneTable, kw_only=True, frozen=True, tag="texture", tag_field="kind"):
    """A picture.

    file: a picture, whose upper edge is the outer rim; unless `opacity` is given, its alpha channel is the opacity of
        the disk, and `slant` is false.
    mirror: false: writing is legible from the south; true: from the north.
    """

    file: str
    mirror: bool = False


class SpotsTable(SceneTable, kw_only=True, frozen=True, tag="spots", tag_field="kind"):
    """Hot spots at random places between the rims, their temperatures between two.

    number: of spots.
    temperature: range, in kelvin.
    size: a length.
    streak: time over which a spot leaves a trace.
    fade: of the streak.
    brightness: range of random factors.
    retrograde: fraction of spots that orbit against the disk.
    seed: of the random numbers.
    """

    number: Count
    temperature: tuple[float, float] = (4000.0, 10000.0)
    size: float = 0.1
    streak: float = 0.0
    fade: Literal["linear", "quadratic"] = "linear"
    brightness: tuple[float, float] = (1.0, 1.0)
    retrograde: Annotated[float, Meta(ge=0, le=1)] = 0.0
    seed: Seed = 0


class WispsTable(SceneTable, kw_only=True, frozen=True, tag="wisps", tag_field="kind"):
    """Gas of uneven depth.

    peak: highest temperature, in kelvin.
    depth: mean optical depth.
    contrast: standard deviation of the logarithm of the depth.
    seed: of the random numbers.
    law: the temperature over the radius.
    """

    peak: float
    depth: float = 1.0
    contrast: float = 1.0
    seed: Seed = 0
    law: TemperatureLaw = "black-body"


EmissionTable = (
    BlackBodyTable | PowerLawTable | PageThorneTable | SwatchesTable | TextureTable | SpotsTable | WispsTable
)


class DiskTable(SceneTable, kw_only=True, frozen=True):
    """A disk.

    inner: radius, or `"isco"`, the innermost stable circular orbit: the retrograde one for `motion = "retrograde"` and
        `"retrograde-plunging"`, else the prograde one.
    outer: radius.
    emission: what makes it shine.
    opacity: see [Disks](disks.md); 1 unless given, wisps have their own.
    slant: as in [Disks](disks.md); true unless given.
    motion: of its matter.
    brightness: relative to the sky; 600 in front of stars, else 1, unless given.
    """

    inner: float | Literal["isco"]
    outer: float
    emission: EmissionTable
    opacity: float | None = None
    slant: bool | None = None
    motion: DiskMotion = "circular"
    brightness: float | None = None


Law = float | str | GridTable
"""A number, an expression of r, theta and phi, or a grid."""


class VolumeTable(SceneTable, kw_only=True, frozen=True):
    """Matter in space.

    inner: radial limit of the matter ([below](#volumes)).
    outer: radial limit.
    density: optical depth per unit of the mass: a number, an expression in `r`, `theta`, `phi`, or `{file =
        "grid.npy"}`.
    temperature: in kelvin, likewise.
    scale: length over which they change; required with an expression.
    motion: `"circular"`, `"fiducial"`, `"static"`, or dφ/dt as an expression in `r` and `theta`.
    brightness: as for a disk.
    colour: a factor, such as `"#ffd0a0"`, or `{file = "colours.npy"}` with an additional axis of length 3, in linear
        sRGB; white unless given.
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
    """Hot spots on circular orbits of their own, at random between pairs of numbers; in place of a volume.

    number: of spots; they hide nothing and obey `light.delay`.
    inner: least radius of an orbit.
    outer: largest radius.
    inclination_deg: range of an orbit's tilt.
    node_deg: range of the azimuth of its ascending node at time 0.
    temperature: range, in kelvin.
    size: a length.
    streak: time over which a spot leaves a trace.
    fade: of the streak.
    brightness: range of random factors.
    retrograde: fraction of spots that orbit against the spin.
    seed: of the random numbers.
    """

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
