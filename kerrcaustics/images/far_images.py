"""Images far out on a screen: refined on the plain sky of a camera at the same place.

A screen shows best what is next to the hole. What is seen directly lies at the radius of the observer from it, where
the rounding of a direction on the engines' sphere is a large length.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from kerrcaustics.beams.ends import End
from kerrcaustics.images.search import ImageSearch
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.lens_map.search_sky import SearchSky, as_seen, radians_of, search_sky

Array = np.ndarray

# Newton steps from a place that is known.
_FEW_STEPS = 8


def sharpened(searched: SearchSky, found: ImageSearch, star: Float[Array, "stars 3"], end: End) -> ImageSearch:
    """The images of stars that an observer at a finite radius finds, those of index 0 with smaller errors."""
    plain, observer = searched.plain_camera, searched.search_camera
    if plain is None:
        return found
    images = found.images
    direct = np.flatnonzero(images.index == 0)
    start = as_seen(images.sky[direct], observer.frame(), plain.frame())
    which, sky, error = find_roots(plain, star[images.star[direct]], images.index[direct], start, _FEW_STEPS, end=end)
    these, sky = direct[which], as_seen(sky, plain.frame(), observer.frame())
    # A radian on the plain sky, on the engines' sphere.
    error = error / radians_of(plain.radius, sky, search_sky(observer).lengths(sky))
    better = error < images.error[these]
    skies, errors = images.sky.copy(), images.error.copy()
    skies[these[better]], errors[these[better]] = sky[better], error[better]
    return replace(found, images=replace(images, sky=skies, error=errors))
