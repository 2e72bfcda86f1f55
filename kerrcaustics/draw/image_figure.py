"""The figure of the images of a source: where they are seen, and where it lies among the caustics."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.palettes import STAR_COLOUR
from kerrcaustics.draw.sky_axes import draw_places
from kerrcaustics.draw.sky_results import caustics_on_surface, image_places
from kerrcaustics.draw.titles import headline, place_in_words
from kerrcaustics.images.images import StarImages
from kerrcaustics.interop.physical_scale import PhysicalScale
from kerrcaustics.shapes import Float

Array = np.ndarray

_STAR: dict[str, Any] = {"marker": "*", "markersize": 11, "color": STAR_COLOUR, "markeredgecolor": "white", "zorder": 3}


def images_figure(images: StarImages, caustics: CausticSet, scale: PhysicalScale | None = None) -> Figure:
    """Figure of the images of a source: the camera sky, and its surface with the caustics, 7 inches wide.

    Parameters
    ----------
    images : StarImages
    caustics : CausticSet
        Of the same camera and surface, orders to max_index + 1.
    scale : PhysicalScale, optional
        With a distance: an observer's sky is in microarcseconds.

    Returns
    -------
    Figure
        Save it with `figure.savefig`. A title says where the source is, and who sees it.
    """
    source = np.array([images.star]), {"label": "source", **_STAR}
    return sky_and_source(
        lambda ax: image_places(ax, images, caustics=caustics, scale=scale), caustics, images.star, source
    )


def sky_and_source(
    drawn: Callable[[Axes], Axes],
    caustics: CausticSet,
    star: tuple[float, float],
    source: tuple[Float[Array, "n 2"], dict[str, Any]],
    brightness: str = "",
) -> Figure:
    """Figure of the images of a source, as they are drawn on axes, beside the source among the caustics.

    star: place of the source; source: places that show it, and the settings of their marks; brightness: of it, in words
    of the title.
    """
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.4), layout="constrained")
        left, right = figure.subplots(1, 2)
        drawn(left).set_title("images and critical curves, camera sky")
        caustics_on_surface(right, caustics)
        draw_places(right, caustics.surface, source[0], **source[1])
        right.set_title("source and caustics")
        own: Any = left.get_legend()
        own.remove()
        (handles, labels), (right_handles, names) = (ax.get_legend_handles_labels() for ax in (left, right))
        once = dict(zip([*labels, names[-1]], [*handles, right_handles[-1]], strict=True))
        figure.legend(once.values(), once.keys(), loc="outside lower center", ncols=4)
        place = f"{place_in_words(caustics.surface, star)}, on {caustics.surface.in_words()}"
        figure.suptitle(f"source at {place}{brightness}\n{headline(caustics)}")
    return figure
