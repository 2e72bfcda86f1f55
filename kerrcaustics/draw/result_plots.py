"""The plots of results by the name of their class, and the small pictures of notebooks."""

from collections.abc import Callable, Sized
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.draw import derivative_results, light_results, sky_results, space_results, style

_SMALL = (4.4, 2.9)

_PLOTS: dict[str, Callable[..., Axes]] = {
    "Beams": sky_results.ray_ends,
    "Camera": sky_results.shadow,
    "Caustic": sky_results.one_caustic,
    "CausticDerivatives": derivative_results.caustic_derivatives,
    "CausticSet": sky_results.caustic_set,
    "CausticTube": space_results.tube_rows,
    "CircleCurve": sky_results.circle_curve,
    "CircleImages": sky_results.circle_curves,
    "CountMap": sky_results.count_map,
    "Cusp": sky_results.cusp_place,
    "IsoradialSet": sky_results.isoradials,
    "FollowedStar": sky_results.followed_images,
    "Footprint": sky_results.footprint_places,
    "ImageCounts": sky_results.star_counts,
    "ImageDerivatives": derivative_results.image_derivatives,
    "Isoradial": sky_results.isoradial,
    "LightCurve": light_results.light_curve,
    "LineCrossings": sky_results.line_crossings,
    "LineProfile": light_results.line_profile,
    "Observer": sky_results.shadow,
    "PairEvent": sky_results.one_event,
    "PairEvents": sky_results.event_places,
    "RayPaths": space_results.space_points,
    "Rays": sky_results.ray_ends,
    "Rendering": light_results.rendering,
    "SpacePoints": space_results.space_points,
    "SpotEvent": sky_results.spot_event,
    "StarCatalogue": sky_results.catalogue,
    "StarField": sky_results.star_field,
    "StarImages": sky_results.image_places,
    "StarTracks": sky_results.all_tracks,
    "TracedView": light_results.traced_view,
    "Track": sky_results.one_track,
    "View": sky_results.picture_border,
    "Screen": sky_results.picture_border,
    "VolumeRendering": light_results.rendering,
}


def plot(result: Any, ax: Axes | None = None, **settings: Any) -> Axes:
    """Draw a result on axes, new ones where none are given, and return them."""
    name = type(result).__name__
    if name not in _PLOTS:
        raise ValueError(f"Argument `result` must be one of {', '.join(sorted(_PLOTS))} to be drawn, but is {name}.")
    if ax is not None:
        return _PLOTS[name](ax, result, **settings)
    with rc_context(style.RC):
        return _PLOTS[name](plt.figure(layout="constrained").add_subplot(), result, **settings)


def small_picture(result: Any) -> Figure | None:
    """A small figure of a result; None for one that cannot be drawn, or that holds nothing."""
    if type(result).__name__ not in _PLOTS or _is_empty(result):
        return None
    with rc_context(style.RC):
        figure = Figure(figsize=_SMALL, layout="constrained", dpi=100)
        plot(result, figure.add_subplot())
    return figure


def _is_empty(result: Any) -> bool:
    """True if a result is an empty sequence, or one of its arrays is empty."""
    if isinstance(result, Sized):
        return len(result) == 0
    return any(isinstance(part, np.ndarray) and part.size == 0 for part in vars(result).values())


def show() -> None:
    """Show what has been plotted in windows, and wait until they are closed; notebooks show plots by themselves.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.Camera(spin=0.9, radius=10).plot()  # doctest: +SKIP
    >>> kc.show()  # doctest: +SKIP
    """
    plt.show()
