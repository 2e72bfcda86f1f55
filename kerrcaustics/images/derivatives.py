"""Derivatives of images by the hole, the viewer and the source: implicit differentiation of the lens map.

An image obeys x(p, N) = x_source on the surface, so that dN = J^-1 (dx_source - dx at fixed N); its magnification and
its travel time are functions of p and N.
"""

from functools import partial

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.images.images import StarImages
from kerrcaustics.lens_map.expansions import expanded, inverse, source_parameters, with_errors
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray


@result("image-derivatives/1", record="star parameters", rows="sky magnification time error")
class ImageDerivatives(Shown):
    """Derivatives of the images of a source, in their order, with respect to the viewer's and the source's parameters.

    A velocity given by name is the motion that belongs to the camera's place, and changes with it; three numbers stay
    fixed.
    """

    star: tuple[float, float] = quantity(
        "angle", "place", "theta', phi' of the source; in the plane r, phi", given=True
    )
    parameters: tuple[str, ...] = quantity(
        "parameter",
        "",
        "parameters of the derivatives, lengths in M and angles in radians: spin, radius, inclination of the viewer "
        "(no radius for an Observer at infinity); theta, phi of the source, in the plane source_radius, phi",
    )
    sky: Array = quantity(
        "image axis parameter",
        "1",
        "derivatives of the directions N on the camera sky; for an Observer, of (alpha, beta)",
    )
    magnification: Array = quantity("image parameter", "1", "derivatives of the magnification")
    time: Array = quantity("image parameter", "GM/c^3", "derivatives of the travel time `StarImages.time`")
    error: Array = quantity(
        "image kind",
        "1",
        "estimated errors of the derivatives of sky, of ln magnification and of time, relative to their largest",
    )
    camera: Viewer = declared.viewer()
    surface: End = declared.surface()

    def __len__(self) -> int:
        """Number of images."""
        return len(self.sky)


@usual_warnings
def image_derivatives(camera: Viewer, images: StarImages) -> ImageDerivatives:
    """Derivatives of place, magnification and travel time of a source's images.

    Parameters
    ----------
    camera : Camera or Observer
        Viewer of the images.
    images : StarImages
        Result of `star_images` for this viewer, for a source on any surface.

    Returns
    -------
    ImageDerivatives

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `ImageDerivatives.error`: the change of the derivatives when the images move by their errors, and with fewer steps
    along the ray. Close to a caustic derivatives grow as 1 / |det J|, and errors as its square.

    Notes
    -----
    The source stays on its surface, a sphere of one radius or one crossing of the plane. An Observer at infinity has no
    radius, and hence no derivative with respect to it; at finite radii that of a place (alpha, beta) falls off as
    1 / radius^2.

    References
    ----------
    The implicit function theorem.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> images = kc.star_images(camera, star=(1.4, 2.9), max_index=0)
    >>> change = kc.image_derivatives(camera, images)
    >>> change.parameters, change.sky.shape
    (('spin', 'radius', 'inclination', 'theta', 'phi'), (1, 3, 5))
    """
    check_viewer(camera)
    _check_images(camera, images)
    (sky, logarithm, time), error = with_errors(partial(_of_images, camera, images), camera, images.sky, images.error)
    return ImageDerivatives(
        star=images.star,
        parameters=(*camera.parameters, *source_parameters(images.surface)),
        sky=sky,
        magnification=images.magnification[:, None] * logarithm,
        time=time,
        error=error,
        camera=camera,
        surface=images.surface,
    )


def _check_images(camera: Viewer, images: object) -> None:
    """Raise ValueError unless images are those of the viewer."""
    if not isinstance(images, StarImages):
        raise ValueError(f"Argument `images` must be StarImages, but is {type(images).__name__}.")
    if images.camera.sky_coordinates != camera.sky_coordinates:
        raise ValueError(
            f"Argument `images` must be those that `camera` sees, but holds {images.camera.sky_coordinates}, not "
            f"{camera.sky_coordinates}."
        )


def _of_images(
    camera: Viewer,
    images: StarImages,
    sky: Float[Array, "rays axes"],
    number: Int[Array, " rays"],
    density: float,
) -> tuple[Array, ...]:
    """Derivatives of the place (n, axes, p), of ln magnification and of time (n, p), for rays that show the source.

    number: of the image that each ray belongs to.
    """
    surface = images.surface
    at = expanded(camera, surface, sky, density, images.second_arrival[number])
    (tangents,) = surface.tangents(np.array([images.star]))
    axes, count = len(tangents), len(sky)
    target_step = np.concatenate([-at.given[:, :axes], np.broadcast_to(tangents, (count, axes, 2))], axis=-1)
    moved = inverse(at.sky[:, :axes]) @ target_step
    given = np.concatenate([at.given[:, 3:], np.zeros((count, 2, 2))], axis=-1)
    time, determinant = np.moveaxis(given + at.sky[:, 3:] @ moved, 1, 0)
    return camera.tangents(sky) @ moved, -determinant / at.values[:, 4:], time
