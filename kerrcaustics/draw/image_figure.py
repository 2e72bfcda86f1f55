"""The figure of the images of a source: where they are seen, and where it lies among the caustics."""

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.palettes import STAR_COLOUR
from kerrcaustics.draw.sky_axes import draw_places
from kerrcaustics.draw.sky_results import caustics_on_surface, image_places
from kerrcaustics.draw.titles import headline, place_in_words
from kerrcaustics.images.images import StarImages

_STAR: dict[str, Any] = {"marker": "*", "markersize": 11, "color": STAR_COLOUR, "markeredgecolor": "white", "zorder": 3}


def images_figure(images: StarImages, caustics: CausticSet) -> Figure:
    """Figure of the images of a source: the camera sky, and its surface with the caustics, 7 inches wide.

    Parameters
    ----------
    images : StarImages
    caustics : CausticSet
        Of the same camera and surface, orders to max_index + 1.

    Returns
    -------
    Figure
        Save it with `figure.savefig`. A title says where the source is, and who sees it.
    """
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.4), layout="constrained")
        left, right = figure.subplots(1, 2)
        image_places(left, images, caustics=caustics).set_title("images and critical curves, camera sky")
        caustics_on_surface(right, caustics)
        draw_places(right, images.surface, np.array([images.star]), label="source", **_STAR)
        right.set_title("source and caustics")
        own: Any = left.get_legend()
        own.remove()
        (handles, labels), (others, _) = (ax.get_legend_handles_labels() for ax in (left, right))
        figure.legend([*handles, others[-1]], [*labels, "source"], loc="outside lower center", ncols=4)
        source = f"{place_in_words(images.surface, images.star)}, on {images.surface.in_words()}"
        figure.suptitle(f"source at {source}\n{headline(caustics)}")
    return figure
