"""Images of a star; those close to the shadow edge are refined (deep_images.py), and measured again."""

import math
from dataclasses import replace

import numpy as np

from kerrcaustics.beams.ends import Spherical
from kerrcaustics.images.deep_images import needs_refinement, refined_at_shadow_edge
from kerrcaustics.images.measured_images import Measured, measured_images
from kerrcaustics.images.search import ImageSearch
from kerrcaustics.lens_map.search_sky import search_camera, search_sky
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


def refined_images(camera: Viewer, end: Spherical, star: tuple[float, float], searched: ImageSearch) -> Measured:
    """The images of one star that a search found; those close to the shadow edge are accurate to round-off.

    Refined images are traced again, so that all their fields refer to the refined place.
    """
    (images,) = measured_images(camera, end, [star], searched)
    times = (images["time"], images["time_error"]) if end.finite else (None, None)
    which = np.flatnonzero(needs_refinement(searched.images.index, searched.images.error, *times))
    if len(which) == 0:
        return images
    deep = refined_at_shadow_edge(
        search_camera(camera),
        searched.images.sky[which],
        searched.images.error[which],
        np.tile(end.vectors(np.array([star])), (len(which), 1)),
        end,
        searched.images.second_arrival[which],
    )
    deep_ones = which[deep.which]

    def with_deep(values: Array, better: Array | None) -> Array:
        values = values.copy()
        values[deep_ones] = better
        return values

    sky, error = with_deep(searched.images.sky, deep.sky), with_deep(searched.images.error, deep.error)
    updated_search = replace(searched, images=replace(searched.images, sky=sky, error=error))
    (refined,) = measured_images(camera, end, [star], updated_search)
    turn, phi = 2 * math.pi, star[1]
    around = phi + turn * np.round((refined["azimuth"][deep_ones] - phi) / turn)
    # N gives the time less accurately than the distance from the shadow edge does.
    time, time_error = search_sky(camera).viewer_time(deep.time, deep.time_error)
    better = {"azimuth": around, "time": time, "time_error": time_error}
    return refined | {name: with_deep(refined[name], values) for name, values in better.items()}
