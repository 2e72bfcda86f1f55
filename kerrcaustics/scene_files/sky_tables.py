"""Tables of scene files: the sky."""

from typing import Literal

from kerrcaustics.scene_files.table_values import SceneTable, Vector
from kerrcaustics.scenes.checkerboard import COLOURS, GAP_COLOUR, Along
from kerrcaustics.scenes.colour import DAYLIGHT
from kerrcaustics.scenes.star_field import BAND, NEBULAE


class NoSky(SceneTable, kw_only=True, frozen=True, tag="none", tag_field="kind"):
    """A black sky."""


class PictureTable(SceneTable, kw_only=True, frozen=True):
    """A picture of the whole sky.

    file: a picture twice as wide as high ([below](#panoramas)).
    mirror: true for a chart of the sphere seen from outside.
    orientation_deg: the point of the picture behind the hole: to the right, up, and a turn clockwise.
    brightness: of white in the picture.
    spectrum: an exponent, three exponents, or wavelengths and powers ([below](#panoramas)); daylight unless given.
    """

    file: str
    mirror: bool = False
    orientation_deg: float | Vector = 0.0
    brightness: float = 1.0
    spectrum: float | tuple[float | tuple[float, float], ...] | None = None


class NebulaeTable(PictureTable, kw_only=True, frozen=True):
    """A picture beside the stars, of the hole's sky or of the stars' own Galaxy.

    frame: the sky of the hole, or that of our Galaxy.
    """

    brightness: float = NEBULAE
    frame: Literal["hole", "galaxy"] = "hole"


class StarsTable(SceneTable, kw_only=True, frozen=True, tag="stars", tag_field="kind"):
    """Stars and the galactic band; the catalogue of the package, with that of a Tycho-2 file where one is named.

    band: brightness of the galactic band; 1 is that of the real one.
    white: temperature that looks white, in kelvin.
    galaxy_tilt_deg: inclination of the galactic plane to that of the hole's equator.
    galaxy_node_deg: azimuth of its ascending node.
    galaxy_centre_deg: angle from the node to the galactic centre.
    tycho2: a file with more stars ([details](scenes.md#stars)).
    nebulae: a picture in addition to the stars ([below](#panoramas)).
    radius: of the sphere that carries the sky, outside the camera, the disk and all photon orbits
        ([details](scenes.md#a-sky-at-a-finite-radius)); infinite unless given.
    """

    band: float = BAND
    white: float = DAYLIGHT
    galaxy_tilt_deg: float = 25.0
    galaxy_node_deg: float = -60.0
    galaxy_centre_deg: float = 60.0
    tycho2: str | None = None
    nebulae: NebulaeTable | None = None
    radius: float | None = None


class CheckerboardTable(SceneTable, kw_only=True, frozen=True, tag="checkerboard", tag_field="kind"):
    """Paint swatches.

    rows: swatches from pole to pole.
    columns: swatches round the axis.
    gap: part of a swatch's period that is a gap.
    colours: `#rrggbb`, from north to south or once round.
    gap_colour: of the gaps.
    along: the direction in which the colours change.
    radius: as for stars.
    """

    rows: int = 15
    columns: int = 30
    gap: float = 0.16
    colours: tuple[str, ...] = COLOURS
    gap_colour: str = GAP_COLOUR
    along: Along = "latitude"
    radius: float | None = None


class PanoramaTable(PictureTable, kw_only=True, frozen=True, tag="panorama", tag_field="kind"):
    """A picture of the whole sky alone.

    radius: as for stars.
    """

    radius: float | None = None


SkyTable = StarsTable | CheckerboardTable | PanoramaTable | NoSky
