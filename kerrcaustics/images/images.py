"""Certified images of a source: a star on a sphere around the hole, or something in the equatorial plane."""

import math
from dataclasses import replace

import numpy as np

from kerrcaustics.beams.ends import End, Spherical, Wherever
from kerrcaustics.images.certificates import certificate_of
from kerrcaustics.images.deep_images import deepened, is_deep
from kerrcaustics.images.search import ImageSearch, on_rings, ring_remark
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.lens_map.arguments import checked_index, direct_remarks
from kerrcaustics.lens_map.domains import leaves_of, search_surface
from kerrcaustics.lens_map.lens_map import TRAVEL_TIME, LensMap
from kerrcaustics.lens_map.measured_light import measured_light
from kerrcaustics.lens_map.search_sky import search_camera, search_sky
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Bool
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray


@result(
    "images/1",
    record="camera surface max_index star certified certificate per_index expected on_caustic remarks",
    rows="sky azimuth index parity magnification magnification_error crossings crossings_certain redshift "
    "redshift_error error time time_error second_arrival",
)
class StarImages(Shown):
    """The images of one source, ordered by Morse index."""

    camera: Viewer = quantity("", "", "the viewer", json="", column="")
    surface: End = quantity("", "", "surface on which the source lies", json="", column="")
    star: tuple[float, float] = quantity(
        "angle", "place", "theta', phi' of the source; in the plane r, phi", given=True
    )
    sky: Array = quantity("image axis", "1", "directions N on the camera sky; of an Observer (alpha, beta)")
    azimuth: Array = quantity("image", "rad", "unwrapped phi' of the ray: phi' plus whole turns", json="phi_deg")
    index: Array = quantity("image", "1", "Morse index")
    parity: Array = quantity("image", "1", "(-1)^index")
    magnification: Array = quantity(
        "image", "magnification", "1 / |det J|: area on the sky per area of the surface, r dr dphi in the plane"
    )
    magnification_error: Array = quantity(
        "image", "magnification", "error of magnification; infinite where the image may lie on the critical curve"
    )
    crossings: Array = quantity("image", "1", "crossings of the equatorial plane")
    crossings_certain: Array = quantity(
        "image", "1", "False where crossings may be off by one: the star lies in the equatorial plane, within errors"
    )
    redshift: Array = quantity("image", "1", "nu_camera / nu_source")
    redshift_error: Array = quantity("image", "1", "error of redshift")
    error: Array = quantity("image", "sky", "error of sky")
    per_index: dict[int, int] = quantity("morse_index", "1", "number of images found, by index")
    expected: dict[int, int] = quantity(
        "morse_index",
        "1",
        "number of images, from the winding of the caustics about the star; in the plane, where there is no "
        "independent count, the number found",
    )
    on_caustic: tuple[int, ...] = quantity(
        "",
        "1",
        "orders of the caustics from which the star cannot be distinguished: it may have two images more or fewer, or, "
        "if the caustic is a point, a ring, which is not among the images",
    )
    certified: bool = quantity(
        "", "1", "True when the certificate holds for every index, and the star lies on no caustic"
    )
    certificate: str = quantity(
        "",
        "",
        "the argument that no image is missing: on spheres winding (the number of images found of each index is "
        "the one that the caustics require); in the plane arcs (the image of the source's circle is whole, and on "
        "each part of it the azimuth runs as the index there requires, once round in all)",
    )
    remarks: tuple[str, ...] = quantity(
        "",
        "",
        "doubts, and what to do about them; even certified images of an Observer at infinity may have a remark: stars "
        "at infinity are seen directly at infinite (alpha, beta)",
    )
    time: Array = quantity("image", "GM/c^3", TRAVEL_TIME)
    time_error: Array = quantity("image", "GM/c^3", "error of time")
    second_arrival: Array = quantity(
        "image", "1", "True if the ray, followed backward, has met the star's sphere before, within the camera's radius"
    )

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index requested."""
        return max(self.per_index)

    def __len__(self) -> int:
        """Number of images."""
        return len(self.index)

    def __repr__(self) -> str:
        """Summary in one line: the star, how many images, whether certified."""
        counts = ", ".join(f"{count} of index {k}" for k, count in self.per_index.items())
        return f"<StarImages of star {self.star}: {counts}{'' if self.certified else ', not certified'}>"


@usual_warnings
@with_progress
def star_images(
    camera: Viewer,
    star: tuple[float, float],
    max_index: int = 2,
    *,
    end: Wherever | End = math.inf,
    progress: Progress | bool | None = None,
) -> StarImages:
    """All images of a star with Morse index 0 to `max_index`, brightest orders first.

    Parameters
    ----------
    camera : Camera or Observer
        Its sky is searched once and kept: the next star seen from the same place costs little.
    star : (theta', phi')
        Radians, on the surface of `end`; in the plane (r, phi).
    max_index : int
        0 to 6. The image counts need the critical curves to order max_index + 1.
    end : float, Sphere or EquatorialPlane
        Radius of the star; math.inf is the celestial sphere. A star nearer to the hole than the camera needs a separate
        search, because the sky is searched from the star (docs/near_sources.md). An `EquatorialPlane`: images by
        rays that cross the plane at the source for the n-th time, seen by cameras that do not lie in it.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    StarImages

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `StarImages.error`, round-off of n' divided by the beam's minor diameter; if that is more than 1e-10, as for
    high indices, the image is refined by its distance from the shadow edge (deep_images.py), to about 1e-14, next to
    an extremal hole to 1e-15 divided by the distance between the horizons. Errors hold on the sky of the camera, with
    aberration. Magnification and redshift are those of the beam in the returned direction. Their errors are their
    changes over the error of that direction, and the error of the beam's area (measured_light.py).

    Notes
    -----
    An Observer at infinity sees stars of the celestial sphere directly at infinite (alpha, beta): images of index 0 are
    then not among the images, and `per_index` and `expected` give 0 for them.

    A star in line with a non-spinning hole and the camera, or on the spin axis together with the camera, is seen as
    rings, which do not count as images here. The remarks list them with their radii; `expected` counts the images of a
    star beside it.

    References
    ----------
    Counting by the winding of caustics: the sky map between two critical curves has no fold, so the number of images
    there is its degree.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> images = kc.star_images(camera, star=(1.4, 2.9), max_index=1)
    >>> images.per_index, images.certified
    ({0: 1, 1: 1}, True)
    """
    check_viewer(camera)
    surface, highest = search_surface(camera, end), checked_index(max_index)
    place = surface.checked("star", star, camera, one=True)
    certificate = certificate_of(surface, camera, highest)
    searched = certificate.searched(place[None])
    images = images_of(camera, surface, [(float(place[0]), float(place[1]))], searched)[0]
    return images if surface.in_plane else _deepened(images, searched, camera, leaves_of(surface, camera).surface)


def images_of(
    camera: Viewer, surface: End, stars: list[tuple[float, float]], searched: ImageSearch
) -> list[StarImages]:
    """The images that a search for some sources found, source by source, as the camera sees them."""
    lens_map, directions = LensMap(camera, surface), searched.images
    light = lens_map.seen(directions.sky, directions.second_arrival)
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
            StarImages(
                camera=camera,
                surface=surface,
                star=star,
                **{name: values[own] for name, values in of_images.items()},
                per_index=dict(enumerate(searched.counts[i].tolist())),
                expected=dict(enumerate(searched.expected[i].tolist())),
                on_caustic=tuple((np.flatnonzero(searched.on_caustic[i]) + 1).tolist()),
                certified=bool(certified[i]),
                certificate=searched.certificate,
                remarks=(*notes, *_ring_remarks(camera, surface, searched.ring[i]), *_remarks(searched, i)),
            )
        )
    return images


def _deepened(images: StarImages, searched: ImageSearch, camera: Viewer, end: Spherical) -> StarImages:
    """The same, with those that lie close to the shadow edge to round-off; searched: where they were found.

    Refined images are traced anew, so that all that is said of them belongs to their place.
    """
    times = (images.time, images.time_error) if end.finite else (None, None)
    which = np.flatnonzero(is_deep(searched.images.index, searched.images.error, *times))
    if len(which) == 0:
        return images
    star = np.tile(end.vectors(np.array([images.star])), (len(which), 1))
    deep = deepened(
        search_camera(camera),
        searched.images.sky[which],
        searched.images.error[which],
        star,
        end,
        searched.images.second_arrival[which],
    )
    deep_ones = which[deep.which]

    def with_deep(values: Array, better: Array | None) -> Array:
        values = values.copy()
        values[deep_ones] = better
        return values

    sky, error = with_deep(searched.images.sky, deep.sky), with_deep(searched.images.error, deep.error)
    there = replace(searched, images=replace(searched.images, sky=sky, error=error))
    (refined,) = images_of(camera, end, [images.star], there)
    turn, phi = 2 * math.pi, images.star[1]
    around = phi + turn * np.round((refined.azimuth[deep_ones] - phi) / turn)
    refined = replace(refined, azimuth=with_deep(refined.azimuth, around))
    # N gives the time less accurately than the distance from the shadow edge does.
    time, late = search_sky(camera).viewer_time(deep.time, deep.time_error)
    return replace(refined, time=with_deep(refined.time, time), time_error=with_deep(refined.time_error, late))


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
