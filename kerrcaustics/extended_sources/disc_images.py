"""The images of a uniform disc: by the sheet method, or by the chart method if that does not certify them."""

from collections.abc import Callable

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.extended_sources.arcs.area import Weight
from kerrcaustics.extended_sources.arcs.image_areas import AREA_TOLERANCE, DiscImages
from kerrcaustics.extended_sources.charts.chart_method import disc_images_on_charts, touching_radii_on_charts
from kerrcaustics.extended_sources.charts.contours import GIVEN_UP
from kerrcaustics.extended_sources.sheets.nearby_caustics import touching_radii
from kerrcaustics.extended_sources.sheets.sheet_method import disc_images_on_sheets
from kerrcaustics.images.certificates import certificate_of
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.results.progress import in_steps
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.viewer import Viewer

# Relative change of the radius of a disc whose limb touches a caustic, tried first.
_NEAREST = 1e-7
# Smaller and smaller changes, tried as long as the discs are certified.
_BESIDE = (1e-2, 1e-3, 1e-4, 1e-5)
# Relative distance of radii below which they count as one.
_APART = 0.01


def disc_images(
    viewer: Viewer,
    surface: End,
    centre: Float[np.ndarray, " axes"],
    angle: float,
    max_index: int,
    weight: Weight | None = None,
    *,
    nested: bool = False,
    tolerance: float = AREA_TOLERANCE,
) -> DiscImages:
    """The images of a disc, by the first method that certifies them.

    If its limb touches a caustic, the areas of slightly smaller and larger discs bound that of the disc.

    Parameters
    ----------
    viewer : Viewer
    surface : End
        Surface on which the disc lies.
    centre : (axes,) array
        Its centre, a vector of the surface.
    angle : float
        Its radius, radians, in the plane a length.
    max_index : int
    weight : function, optional
        Weight of the area on the viewer's sky.
    nested : bool
        True for a disc within one that has been measured: in the plane fewer places in it are checked.
    tolerance : float
        Requested relative error of the area.
    """

    def sheet_method(radius: float) -> DiscImages:
        disc = disc_images_on_sheets(viewer, surface, centre, radius, max_index, weight, tolerance)
        return disc.uncertified_unless_known()

    def chart_method(radius: float) -> DiscImages:
        disc = disc_images_on_charts(
            viewer, surface, centre, radius, max_index, weight, nested=nested, tolerance=tolerance
        )
        return disc.uncertified_unless_known()

    # The methods are independent: one may certify a disc that the other cannot.
    follows = certificate_of(surface, viewer, max_index).follows
    doubtful: dict[Callable[[float], DiscImages], DiscImages] = {}
    for method in (sheet_method, chart_method) if follows else (chart_method,):
        doubtful[method] = method(angle)
        if doubtful[method].certified:
            return doubtful[method]
    for method, here in doubtful.items():
        if GIVEN_UP not in here.remarks:
            best = _between_neighbours(method, here)
            if best.certified:
                return best
    return next(iter(doubtful.values()))


def _between_neighbours(method: Callable[[float], DiscImages], here: DiscImages) -> DiscImages:
    """The disc between certified ones that are a little smaller and larger; the disc itself if there are none."""
    best = here
    for part in in_steps("check by a source of another size", (_NEAREST, *_BESIDE)):
        low = high = method(here.angle * (1 - part))
        if low.certified:
            high = method(here.angle * (1 + part))
        if high.certified:
            best = here.interpolated(low, high)
        # The nearest discs suffice. The others are tried from the largest change, which is certified first.
        if high.certified == (part == _NEAREST):
            break
    return best


def kinks(
    viewer: Viewer, surface: End, centre: Float[np.ndarray, " axes"], angle: float, max_index: int
) -> Float[np.ndarray, " radii"]:
    """Approximate radii of smaller discs whose limb touches a caustic: the area of the images is not smooth there.

    Radii next to 0 or to that of the disc count as these.
    """
    if certificate_of(surface, viewer, max_index).follows:
        radii = touching_radii(sheets_of(viewer, max_index, surface), centre, angle)
    else:
        radii = touching_radii_on_charts(viewer, surface, centre, angle, max_index)
    radii = radii[radii < (1 + _APART) * angle]
    radii = np.select([radii < _APART * angle, radii > (1 - _APART) * angle], [0.0, angle], radii)
    return radii[np.concatenate([[True], np.diff(radii) > _APART * angle])[: len(radii)]]
