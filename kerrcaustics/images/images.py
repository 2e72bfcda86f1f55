"""Certified images of a source: a star on a sphere around the hole, or something in the equatorial plane."""

import math
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.images.certificates import certificate_of
from kerrcaustics.images.measured_images import measured_images
from kerrcaustics.images.refined_images import refined_images
from kerrcaustics.images.search import ImageSearch
from kerrcaustics.lens_map.arguments import checked_index
from kerrcaustics.lens_map.domains import leaves_of, search_surface
from kerrcaustics.lens_map.lens_map import TRAVEL_TIME
from kerrcaustics.results import declared
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
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

    camera: Viewer = declared.viewer()
    surface: End = declared.surface()
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
    certified: bool = declared.certified(
        "True when the certificate holds for every index, and the star lies on no caustic"
    )
    certificate: str = quantity(
        "",
        "",
        "the argument that no image is missing: on spheres winding (the number of images found of each index is "
        "the one that the caustics require); in the plane arcs (the image of the source's circle is whole, and on "
        "each part of it the azimuth runs as the index there requires, once round in all)",
    )
    remarks: tuple[str, ...] = declared.remarks(
        "doubts, and what to do about them; even certified images of an Observer at infinity may have a remark: stars "
        "at infinity are seen directly at infinite (alpha, beta)"
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

    def function(self) -> Callable[..., Any]:
        """These images as a function that JAX compiles and differentiates.

        Returns
        -------
        callable
            With the parameters spin, radius, inclination and star (theta', phi'), each with the value of this result
            if it is left out. It returns `kerrcaustics.functional.Images`: sky, magnification and time of each image
            of this result at other parameters, NaN where one is lost, computed in float64, and rounded to float32
            unless `jax_enable_x64` is set. The camera keeps its `velocity`.

        Raises
        ------
        ValueError
            Unless the source is on the celestial sphere, and the viewer is a Camera.

        Errors
        ------
        As for `kerrcaustics.functional.images`.

        Examples
        --------
        >>> import jax, kerrcaustics as kc
        >>> images = kc.star_images(kc.Camera(spin=0.9, radius=10), star=(1.4, 2.9), max_index=1)
        >>> seen = images.function()
        >>> slope = jax.grad(lambda spin: seen(spin=spin).magnification.sum())(0.9)
        """
        return import_module("kerrcaustics.functional.functions_of_results").function_of(self)


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
    searched = certificate_of(surface, camera, highest).images(place[None])
    source = (float(place[0]), float(place[1]))
    if surface.in_plane:
        return images_of(camera, surface, [source], searched)[0]
    return StarImages(**refined_images(camera, leaves_of(surface, camera).surface, source, searched))


def images_of(
    camera: Viewer, surface: End, stars: list[tuple[float, float]], searched: ImageSearch
) -> list[StarImages]:
    """The images that a search for some sources found, source by source, as the camera sees them."""
    return [StarImages(**fields) for fields in measured_images(camera, surface, stars, searched)]
