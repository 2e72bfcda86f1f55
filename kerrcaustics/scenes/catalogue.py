"""Stars as data: the catalogue of the package, and the directions of the Galaxy."""

import math
import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from kerrcaustics.beams.directions import normalised
from kerrcaustics.extras import needed
from kerrcaustics.files import reading
from kerrcaustics.results.shown import Shown
from kerrcaustics.scenes.scene_checks import check_number
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import instance_of, quoted, real_array
from kerrcaustics.spacetime.sphere import from_angles

Array = np.ndarray

_FILE = Path(__file__).parent / "data" / "hipparcos.npz"
# Right ascension and declination of the north galactic pole, degrees, J2000.
_POLE = (192.85948, 27.12825)
# Galactic longitude of the north celestial pole, degrees, J2000.
_NODE = 122.93192

# Largest file of a catalogue, bytes.
_LARGEST = 1_000_000_000
# Colour index B - V of the Sun.
_SUN = 0.65
# Angle (radians) below which two entries are one star.
_SAME = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class StarCatalogue(Shown):
    """A catalogue of stars.

    Parameters
    ----------
    direction : (n, 3) array
        Vectors of any length, such as positions in parsecs; as an attribute they are unit vectors.
    magnitude : (n,) array
    colour_index : (n,) array
        B - V.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.skies.StarCatalogue(direction=[[0.0, 0.0, 1.0]], magnitude=[2.0], colour_index=[0.6]).magnitude
    array([2.])
    """

    direction: Float[Array, "stars 3"]
    magnitude: Float[Array, " stars"]
    colour_index: Float[Array, " stars"]

    def __post_init__(self) -> None:
        """Raise ValueError unless the stars are valid."""
        shape = real_array("direction", self.direction).shape
        if len(shape) != 2 or shape[1] != 3:
            raise ValueError(f"Argument `direction` must have the shape (n, 3), but has {shape}.")
        for name in ("direction", "magnitude", "colour_index"):
            values = real_array(name, getattr(self, name))
            object.__setattr__(self, name, values)
            if len(np.atleast_1d(values)) != shape[0] or values.ndim != (2 if name == "direction" else 1):
                raise ValueError(
                    f"Argument `{name}` must hold one for each of {shape[0]} stars, but is {quoted(values)}."
                )
            if not np.isfinite(values).all():
                raise ValueError(f"Argument `{name}` must hold finite numbers.")
        object.__setattr__(self, "direction", normalised(self.direction, "direction"))

    def __len__(self) -> int:
        """Number of stars."""
        return len(self.magnitude)


@cache
def hipparcos() -> StarCatalogue:
    """The 37,622 stars of the Hipparcos-2 catalogue with Hp up to 8, ICRS directions, brightest first.

    References: van Leeuwen 2007, A&A 474, 653. A file beside the data describes their origin.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> len(kc.skies.hipparcos())
    37622
    """
    with np.load(_FILE, allow_pickle=False) as stored:
        right_ascension, declination = stored["right_ascension"].astype(float), stored["declination"].astype(float)
        hp, colour_index = stored["hp"] / 1000, stored["colour_index"] / 1000
    return StarCatalogue(from_angles(math.pi / 2 - declination, right_ascension), hp, colour_index)


def tycho2(path: str | os.PathLike[str]) -> StarCatalogue:
    """The stars of a Tycho-2 index file of astrometry.net, such as index-tycho2-10.littleendian.fits: 362,950 stars.

    Directions are ICRS, to 1e-9 rad; magnitudes are V_T; the file has no colours, and those of the Sun are used. Bright
    stars are missing: see `merged_catalogues`. Needs the package astropy.

    References: Hog et al. 2000, A&A 355, L27.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    ValueError
        If the file cannot be read, or holds no such stars.
    ImportError
        Without the package astropy.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.skies.tycho2("index-tycho2-10.littleendian.fits")  # doctest: +SKIP
    """
    fits = needed("catalogues", "astropy.io.fits")
    try:
        with reading(path, _LARGEST), fits.open(path) as tables:
            if sum(table.size for table in tables) > _LARGEST:
                raise ValueError("it is packed, and too large")
            direction, magnitude = _tycho2_stars({table.columns[0].name: table for table in tables[1:]})
    except (OSError, KeyError, IndexError, AttributeError, ValueError):
        raise ValueError(
            f"Argument `path` must name a Tycho-2 index file of astrometry.net, but {os.fspath(path)!r} is none."
        ) from None
    order = np.argsort(magnitude, kind="stable")
    return StarCatalogue(direction[order], magnitude[order], np.full(len(order), _SUN))


def _tycho2_stars(tables: dict[str, Any]) -> tuple[Float[Array, "stars 3"], Float[Array, " stars"]]:
    """Directions and magnitudes in the tables of the file, by the names of their first columns."""
    # As bytes: limits low and high (3 each) and a scale; then three whole numbers for each star.
    values = np.frombuffer(tables["kdtree_range_stars"].data.tobytes(), "<f8")
    numbers = np.frombuffer(tables["kdtree_data_stars"].data.tobytes(), "<u4").reshape(-1, 3)
    direction = values[:3] + numbers / values[6]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction, np.asarray(tables["MAG_VT"].data["MAG_VT"], float)


def merged_catalogues(first: StarCatalogue, second: StarCatalogue) -> StarCatalogue:
    """Both catalogues merged, brightest first; stars of the second within 20 arcseconds of the first are dropped.

    Parameters
    ----------
    first, second : StarCatalogue
        Catalogues in the same frame, such as ICRS.

    Raises
    ------
    ValueError
        If an argument is not a catalogue.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> stars = kc.skies.hipparcos()
    >>> len(kc.skies.merged_catalogues(stars, stars)) == len(stars)
    True
    """
    from scipy.spatial import KDTree

    instance_of("first", first, StarCatalogue)
    instance_of("second", second, StarCatalogue)
    is_new = KDTree(first.direction).query(second.direction, distance_upper_bound=_SAME)[0] > _SAME
    names = ("direction", "magnitude", "colour_index")
    values = [np.concatenate([getattr(first, name), getattr(second, name)[is_new]]) for name in names]
    order = np.argsort(values[1], kind="stable")
    return StarCatalogue(*(value[order] for value in values))


def galactic_axes() -> Float[Array, "3 3"]:
    """Rotation (3, 3) from ICRS to galactic directions: x to the centre of the Galaxy, z to its north pole.

    References: ESA 1997, The Hipparcos and Tycho Catalogues, vol. 1, sec. 1.5.3, for the angles.
    """
    alpha, delta, node = (math.radians(angle) for angle in (*_POLE, _NODE))
    pole = from_angles(math.pi / 2 - delta, alpha)
    # Toward the celestial north pole, perpendicular to the galactic pole: at longitude `node`.
    north = np.array([0.0, 0.0, 1.0]) - math.sin(delta) * pole
    north /= np.linalg.norm(north)
    beside = np.cross(pole, north)
    x = math.cos(node) * north - math.sin(node) * beside
    return np.stack([x, np.cross(pole, x), pole])


def tilted_galaxy(tilt: float, node: float, centre: float) -> Float[Array, "3 3"]:
    """Rotation (3, 3) from ICRS directions to the celestial sphere, for a given orientation of the galactic plane.

    Parameters
    ----------
    tilt : float
        Angle between the galactic plane and the hole's equatorial plane, radians.
    node : float
        phi' at which the galactic plane rises through the equatorial one.
    centre : float
        Angle from there, along the galactic plane, to the centre of the Galaxy.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.skies.tilted_galaxy(tilt=0.4, node=-1.0, centre=1.0).shape
    (3, 3)
    """
    for name, value in (("tilt", tilt), ("node", node), ("centre", centre)):
        check_number(name, value, "be a finite number of radians")
    c, s = math.cos(tilt), math.sin(tilt)
    incline = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return _about_z(node) @ incline @ _about_z(centre) @ galactic_axes()


def _about_z(angle: float) -> Float[Array, "3 3"]:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
