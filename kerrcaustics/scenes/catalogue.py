"""Stars as data: the catalogue of the package, and the directions of the Galaxy."""

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from kerrcaustics.spacetime.sphere import from_angles

Array = np.ndarray

_FILE = Path(__file__).parent / "data" / "hipparcos.npz"
# North galactic pole (right ascension, declination) and galactic longitude of the north celestial pole, degrees, J2000.
_POLE, _NODE = (192.85948, 27.12825), 122.93192


@dataclass(frozen=True, eq=False)
class StarCatalogue:
    """Stars: direction (n, 3), unit vectors; magnitude (n,); colour_index (n,), B - V."""

    direction: Array
    magnitude: Array
    colour_index: Array

    def __len__(self) -> int:
        """Number of stars."""
        return len(self.magnitude)


@cache
def hipparcos() -> StarCatalogue:
    """The 37,622 stars of the Hipparcos-2 catalogue with Hp up to 8, ICRS directions, brightest first.

    References: van Leeuwen 2007, A&A 474, 653. The file beside the data says where they come from.
    """
    with np.load(_FILE, allow_pickle=False) as stored:
        right_ascension, declination = stored["right_ascension"].astype(float), stored["declination"].astype(float)
        hp, colour_index = stored["hp"] / 1000, stored["colour_index"] / 1000
    return StarCatalogue(from_angles(math.pi / 2 - declination, right_ascension), hp, colour_index)


def galactic_axes() -> Array:
    """Rotation (3, 3) from ICRS to galactic directions: x to the centre of the Galaxy, z to its north pole.

    References: ESA 1997, The Hipparcos and Tycho Catalogues, vol. 1, sec. 1.5.3, for the angles.
    """
    alpha, delta, node = (math.radians(angle) for angle in (*_POLE, _NODE))
    pole = from_angles(math.pi / 2 - delta, alpha)
    # Toward the celestial north pole, at right angles to the galactic one: at longitude `node`.
    north = np.array([0.0, 0.0, 1.0]) - math.sin(delta) * pole
    north /= np.linalg.norm(north)
    beside = np.cross(pole, north)
    x = math.cos(node) * north - math.sin(node) * beside
    return np.stack([x, np.cross(pole, x), pole])


def tilted_galaxy(tilt: float, node: float, centre: float) -> Array:
    """Rotation (3, 3) from ICRS directions to the celestial sphere, with the galactic plane where it is wanted.

    Parameters
    ----------
    tilt : float
        Angle between the galactic plane and the hole's equatorial plane, radians.
    node : float
        phi' at which the galactic plane rises through the equatorial one.
    centre : float
        Angle from there, along the galactic plane, to the centre of the Galaxy.
    """
    for name, value in (("tilt", tilt), ("node", node), ("centre", centre)):
        if not (isinstance(value, int | float) and math.isfinite(value)):
            raise ValueError(f"Argument `{name}` must be a finite number of radians, but is {value!r}.")
    c, s = math.cos(tilt), math.sin(tilt)
    incline = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return _about_z(node) @ incline @ _about_z(centre) @ galactic_axes()


def _about_z(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
