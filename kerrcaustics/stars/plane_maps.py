"""How many images sources all over the equatorial plane have, at one crossing of it."""

import math

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import numbers
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.stars.plane_images import plane_counts

Array = np.ndarray

# Radii that are looked at: from so many horizon radii to so many camera radii.
_LOWEST, _HIGHEST, _FROM_AFAR = 1.05, 2.0, 100.0


@result("plane-count-map/1", record="crossing max_index radius phi counts on_caustic certified")
class PlaneCountMap:
    """Image counts over the equatorial plane, at one crossing, circle by circle."""

    crossing: int = quantity("", "1", "which crossing of the plane, from 1")
    radius: Array = quantity("radius", "GM/c^2", "of the circles, r")
    phi: Array = quantity("phi", "rad", "azimuths of the sources on each circle")
    counts: Array = quantity("radius phi morse_index", "1", "images of a source there, by Morse index")
    on_caustic: Array = quantity("radius phi", "1", "True where a source cannot be told from a caustic")
    certified: Array = quantity("radius phi", "1", "True as in `PlaneImages`")

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index that was asked for."""
        return self.counts.shape[2] - 1

    def __repr__(self) -> str:
        """One line: where, and how much of it is certified."""
        rows, columns = self.certified.shape
        sure = f"{int(self.certified.sum())} certified"
        return f"<PlaneCountMap of crossing {self.crossing}, {rows} circles of {columns} sources, {sure}>"


def plane_count_map(
    camera: Viewer, max_index: int, radii: ArrayLike | int, columns: int, end: EquatorialPlane
) -> PlaneCountMap:
    """Counts on circles of some radii; a number: so many, in equal ratios, from the horizon to beyond the camera."""
    radius = _spread(camera, radii) if isinstance(radii, int) else _checked(camera, radii)
    phi = (np.arange(columns) + 0.5) * 2 * math.pi / columns
    grid = np.stack(np.meshgrid(radius, phi, indexing="ij"), axis=-1)
    found = plane_counts(camera, grid.reshape(-1, 2), max_index, end)
    shape = grid.shape[:2]
    counts = found.counts.reshape(*shape, -1)
    near, certified = found.on_caustic.reshape(shape), found.certified.reshape(shape)
    return PlaneCountMap(end.crossing, radius, phi, counts, near, certified)


def _spread(camera: Viewer, rows: int) -> Array:
    highest = min(_FROM_AFAR, _HIGHEST * camera.radius)
    return np.geomspace(_LOWEST * kerr.horizon(camera.spin), highest, rows)


def _checked(camera: Viewer, radii: ArrayLike) -> Array:
    radius, horizon = numbers("radii", radii), kerr.horizon(camera.spin)
    rising = radius.ndim == 1 and len(radius) > 0 and bool((np.diff(radius) > 0).all())
    if not (rising and horizon < radius[0] and radius[-1] < math.inf):
        raise ValueError(
            f"Argument `radii` must be radii in rising order, larger than the horizon's {horizon:.12g}, but is "
            f"{radii!r}."
        )
    return radius
