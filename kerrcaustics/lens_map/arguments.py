"""Checks of the arguments that all analyses of the lens map share, and a remark on what they leave out."""

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import numbers, quoted, real_number, whole_number
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

HIGHEST_INDEX = 6

_DIRECT = "stars are seen directly, by images of index 0, at infinite (alpha, beta): these are not among the images"


def checked_index(max_index: object) -> int:
    """The argument `max_index`; ValueError unless it is valid."""
    return whole_number("max_index", max_index, 0, HIGHEST_INDEX)


def checked_tolerance(tolerance: object, least: float, most: float) -> float:
    """The argument `tolerance`; ValueError unless it lies in a range."""
    number = real_number("tolerance", tolerance)
    if not least <= number <= most:
        raise ValueError(f"Argument `tolerance` must lie in [{least:g}, {most:g}], but is {quoted(tolerance)}.")
    return number


def checked_place(name: str, place: object, viewer: Viewer, surface: End = SKY) -> tuple[float, float]:
    """A place on a surface that the user gave as the argument `name`."""
    first, second = surface.checked(name, place, viewer, one=True).tolist()
    return first, second


def direct_remarks(surface: End, camera: Viewer) -> tuple[str, ...]:
    """The remark that images of index 0 lie at infinite (alpha, beta), if they do."""
    return (_DIRECT,) if domain_of(surface, camera).unbounded else ()


def checked_radii(camera: Viewer, name: str, radii: ArrayLike) -> Float[Array, " circles"]:
    """The radii of an argument, outside the horizon of the camera's hole."""
    check_viewer(camera)
    circles, horizon = numbers(name, radii).ravel(), kerr.horizon(camera.spin)
    if not (len(circles) and np.isfinite(circles).all() and (circles > horizon).all()):
        raise ValueError(
            f"Argument `{name}` must be finite and larger than the horizon radius {horizon:.12g}, "
            f"but is {quoted(radii)}."
        )
    return circles
