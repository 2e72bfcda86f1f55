"""The plots of results by the name of their class, and the small pictures of notebooks."""

from collections.abc import Callable, Sized
from importlib import import_module
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.draw import style
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.results.shown import Items
from kerrcaustics.spacetime.viewer import Viewer

_SMALL = (4.4, 2.9)

PLOTS: dict[str, str] = {
    "Amplification": "waves.amplification_curve",
    "Beams": "sky_results.ray_ends",
    "Camera": "sky_results.shadow",
    "Caustic": "sky_results.one_caustic",
    "CausticDerivatives": "derivative_results.caustic_derivatives",
    "CausticSet": "sky_results.caustic_set",
    "CausticTube": "space_results.tube_rows",
    "CircleCurve": "sky_results.circle_curve",
    "CircleImages": "sky_results.circle_curves",
    "BandEdge": "ring_results.band_edge",
    "CountMap": "sky_results.count_map",
    "Cusp": "sky_results.cusp_place",
    "DiffractionPattern": "waves.intensity",
    "EventDerivatives": "derivative_results.event_derivatives",
    "IsoradialSet": "sky_results.isoradials",
    "FollowedStar": "sky_results.followed_images",
    "Footprint": "sky_results.footprint_places",
    "ImageCounts": "sky_results.star_counts",
    "ImageDerivatives": "derivative_results.image_derivatives",
    "Isoradial": "sky_results.isoradial",
    "LightCurve": "light_results.light_curve",
    "LimbImage": "source_images.limb_image",
    "LineCrossings": "sky_results.line_crossings",
    "LineProfile": "light_results.line_profile",
    "Magnification": "source_images.source_images",
    "Observer": "sky_results.shadow",
    "PairEvent": "sky_results.one_event",
    "PairEvents": "sky_results.event_places",
    "PathBeams": "space_results.path_beams",
    "PhotonBand": "ring_results.one_band",
    "PhotonRings": "ring_results.bands_on_sky",
    "RayPaths": "space_results.space_points",
    "Rays": "sky_results.ray_ends",
    "Rendering": "light_results.rendering",
    "RingEdge": "ring_results.exponents_along_edge",
    "SourceEvent": "sky_results.spot_event",
    "SpacePoints": "space_results.space_points",
    "SpotEvent": "sky_results.spot_event",
    "StarCatalogue": "star_results.catalogue",
    "Screen": "sky_results.picture_border",
    "StarField": "star_results.star_field",
    "StarImages": "sky_results.image_places",
    "StarTracks": "sky_results.all_tracks",
    "TracedView": "light_results.traced_view",
    "Track": "sky_results.one_track",
    "Visibilities": "ring_results.visibility_amplitude",
    "View": "sky_results.picture_border",
    "VolumeRendering": "light_results.rendering",
}
"""The functions that draw results, with their modules beside this one, by the names of classes.

Each module loads what it draws: all of them together take longer than the first plot may. docs/plots.md shows what the
functions say of themselves.
"""


def plot_of(name: str) -> Callable[..., Axes]:
    """The function that draws results of a class."""
    module, function = PLOTS[name].split(".")
    return getattr(import_module(f"kerrcaustics.draw.{module}"), function)


def plot(result: Any, ax: Axes | None = None, **settings: Any) -> Axes:
    """Draw a result on axes, new ones where none are given, and return them."""
    name = type(result).__name__
    if name not in PLOTS:
        raise ValueError(f"Argument `result` must be one of {', '.join(sorted(PLOTS))} to be drawn, but is {name}.")
    if ax is not None:
        return _titled(plot_of(name)(ax, result, **settings), result)
    with rc_context(style.RC):
        return plot(result, plt.figure(layout="constrained").add_subplot(), **settings)


def _titled(ax: Axes, result: Any) -> Axes:
    """Axes with the viewer of the result in their title, where they have none; with the spin where that is known."""
    viewer = _viewer(result)
    if not ax.get_title() and isinstance(viewer, Viewer):
        ax.set_title(viewer_in_words(viewer))
    elif not ax.get_title() and hasattr(result, "spin"):
        ax.set_title(f"spin {result.spin:.12g}")
    return ax


def _viewer(result: Any) -> Viewer | None:
    """The viewer that a result is, or knows; of a sequence without one of its own, that of its items."""
    if isinstance(result, Viewer):
        return result
    items = result[:1] if isinstance(result, Items) else ()
    return getattr(result, "camera", getattr(items[0], "camera", None) if items else None)


def small_picture(result: Any) -> Figure | None:
    """A small figure of a result; None for one that cannot be drawn, or that holds nothing."""
    if type(result).__name__ not in PLOTS or _is_empty(result):
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
