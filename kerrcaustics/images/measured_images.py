"""Images that a search found, measured on the camera's sky: the fields of `StarImages`, and remarks on doubts."""

import math
from typing import Any

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.images.search import ImageSearch, on_rings, ring_remark
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.lens_map.arguments import direct_remarks
from kerrcaustics.lens_map.lens_map import LensMap
from kerrcaustics.lens_map.measured_light import measured_light
from kerrcaustics.shapes import Bool
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

Measured = dict[str, Any]
"""The fields of `StarImages` by their names."""


def measured_images(
    camera: Viewer, surface: End, stars: list[tuple[float, float]], searched: ImageSearch
) -> list[Measured]:
    """The images that a search for some sources found, source by source, as the camera sees them."""
    lens_map, directions = LensMap(camera, surface), searched.images
    light = lens_map.light_at(directions.sky, directions.second_arrival)
    at = measured_light(lens_map, light, directions.sky, directions.error, directions.second_arrival)
    of_images = {
        "sky": at.sky,
        "azimuth": at.azimuth,
        "index": directions.index,
        "parity": 1 - 2 * (directions.index % 2),
        "magnification": at.magnification,
        "magnification_error": at.magnification_error,
        "crossings": np.asarray(at.beams.crossings),
        "crossings_certain": np.asarray(at.beams.crossings_certain),
        "redshift": at.redshift,
        "redshift_error": at.redshift_error,
        "error": at.error,
        "time": at.time,
        "time_error": at.time_error,
        "second_arrival": directions.second_arrival,
    }
    notes, certified = direct_remarks(surface, camera), searched.certified
    by_star = np.argsort(directions.star, kind="stable")
    bounds = np.searchsorted(directions.star[by_star], np.arange(len(stars) + 1))
    images = []
    for i, star in enumerate(stars):
        own = by_star[bounds[i] : bounds[i + 1]]
        images.append(
            {
                "camera": camera,
                "surface": surface,
                "star": star,
                **{name: values[own] for name, values in of_images.items()},
                "per_index": dict(enumerate(searched.counts[i].tolist())),
                "expected": dict(enumerate(searched.expected[i].tolist())),
                "on_caustic": tuple((np.flatnonzero(searched.on_caustic[i]) + 1).tolist()),
                "certified": bool(certified[i]),
                "certificate": searched.certificate,
                "remarks": (*notes, *_ring_remarks(camera, surface, searched.ring[i]), *_remarks(searched, i)),
            }
        )
    return images


def _ring_remarks(camera: Viewer, surface: End, ring: Bool[Array, " orders"]) -> tuple[str, ...]:
    """Remarks about rings; ring: by order, True where the star lies on a caustic that is a point."""
    if not ring.any():
        return ()
    curves = sheets_of(camera, len(ring) - 1, surface).curves
    return tuple(ring_remark(camera, surface, curve) for curve in curves if ring[curve.order - 1])


def _remarks(searched: ImageSearch, star: int) -> tuple[str, ...]:
    """Remarks about one of the stars, but for rings."""
    counts, expected, coarse = searched.counts[star], searched.expected[star], searched.coarse
    orders = (np.flatnonzero(searched.on_caustic[star] & ~searched.ring[star]) + 1).tolist()
    remarks = list(searched.remarks[star]) if searched.remarks else []
    remarks += [
        f"the star cannot be distinguished from the caustic of order {order}: it may have two images more, or less; "
        "move it by more than its error"
        for order in orders
    ]
    missing = counts != expected
    if missing.any():
        missing &= ~on_rings(searched.ring[[star]])[0]
    remarks += [
        f"index {k}: the search found {counts[k]} images, the caustics require {expected[k]}; "
        + (
            f"its sheet is searched in steps of {math.degrees(coarse[k]):.0f} degrees, as 10 take too long"
            if coarse[k] > 0
            else "move the star or the camera a little and compare"
        )
        for k in np.flatnonzero(missing).tolist()
    ]
    return tuple(remarks)
