"""Checks of the arguments that all analyses of the lens map share, and a remark on what they leave out."""

from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.spacetime.checks import whole_number
from kerrcaustics.spacetime.viewer import Viewer

HIGHEST_INDEX = 6

_DIRECT = "stars are seen directly, by images of index 0, at infinite (alpha, beta): these are not among the images"


def checked_index(max_index: object) -> int:
    """The argument `max_index`; ValueError unless it is valid."""
    return whole_number("max_index", max_index, 0, HIGHEST_INDEX)


def checked_place(name: str, place: object, viewer: Viewer, surface: End = SKY) -> tuple[float, float]:
    """A place on a surface that the user gave as the argument `name`."""
    first, second = surface.checked(name, place, viewer, one=True).tolist()
    return first, second


def direct_remarks(surface: End, camera: Viewer) -> tuple[str, ...]:
    """The remark that images of index 0 lie at infinite (alpha, beta), if they do."""
    return (_DIRECT,) if domain_of(surface, camera).unbounded else ()
