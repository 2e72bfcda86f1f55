"""Derivatives of images and caustics by the hole, the camera and the star: implicit differentiation of the sky map.

An image obeys n'(p, N) = n_star, so that dN = J^-1 (dn_star - dn' at fixed N); its magnification and its travel time
are functions of p and N. A caustic is the image of the curve det J = 0. Where that moves with p, motion along
itself means nothing; taken at right angles, N moves by -(d det J at fixed N) grad det J / |grad det J|^2, and the
caustic with it. So move its extremes, where the caustic has no motion of its own in that coordinate, and its cusps,
where it has none at all.
"""

import math

import numpy as np
from jaxtyping import Float
from numpy.polynomial import chebyshev

from kerrcaustics.beams.compile_cache import Program
from kerrcaustics.beams.differentiable import Moving, expansion, motion_of
from kerrcaustics.beams.integrator.integrated import DENSEST
from kerrcaustics.curves.caustic_search import check_orders
from kerrcaustics.curves.critical_curves import critical_curves
from kerrcaustics.curves.features import extreme_places, find_features, fitted
from kerrcaustics.images.images import StarImages
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.spacetime.camera import check_camera
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.settings import own_settings
from kerrcaustics.spacetime.sphere import from_angles, polar_basis, tangent_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

PARAMETERS = ("spin", "radius", "inclination", "theta", "phi")
"""What images are differentiated by; caustics by the first three."""

# Rays in one call of the compiled program.
_BATCH = 32
# Fewer steps, for an error of those.
_SPARSER = 0.8 * DENSEST
_TOLERANCE = 1e-12

_expansion = Program(expansion)


@result("image-derivatives/1", record="star parameters", rows="sky magnification time error")
class ImageDerivatives:
    """Derivatives of the images of a star, in their order, by spin, radius, inclination, and the star's theta', phi'.

    Of the camera's velocity a name is the motion that belongs to the place and changes with it; three numbers stay.
    """

    star: tuple[float, float] = quantity("angle", "rad", "theta', phi' of the star", given=True)
    parameters: tuple[str, ...] = quantity("parameter", "", "what the derivatives are by, angles in radians")
    sky: Array = quantity("image axis parameter", "1", "derivatives of the directions N on the camera sky")
    magnification: Array = quantity("image parameter", "1", "derivatives of the magnification")
    time: Array = quantity("image parameter", "GM/c^3", "derivatives of the travel time, the limit of t - r - 2 ln r")
    error: Array = quantity(
        "image axis",
        "1",
        "estimated errors of the derivatives of N, of ln magnification and of time, relative to their largest",
    )

    def __len__(self) -> int:
        """Number of images."""
        return len(self.sky)


@result("caustic-derivatives/1", record="order parameters theta_min theta_max phi_min phi_max cusps error remarks")
class CausticDerivatives:
    """Derivatives of the cusps and extremes of one caustic by spin, radius and inclination."""

    order: int = quantity("", "1", "that of the caustic")
    parameters: tuple[str, ...] = quantity("parameter", "", "what the derivatives are by, angles in radians")
    cusps: Array = quantity("cusp_number angle parameter", "1", "of (theta', unwrapped phi') of the cusps")
    theta_min: Array = quantity("parameter", "1", "of the least theta'")
    theta_max: Array = quantity("parameter", "1", "of the largest theta'")
    phi_min: Array = quantity("parameter", "1", "of the least phi'")
    phi_max: Array = quantity("parameter", "1", "of the largest phi'")
    error: float = quantity("", "1", "estimated error of all of them, relative to the largest of each")
    remarks: tuple[str, ...] = quantity("", "", "what is not known (NaN), and why", default=())

    @property
    @derived("parameter", "1")
    def theta_extent(self) -> Array:
        """Of the width in theta'."""
        return self.theta_max - self.theta_min

    @property
    @derived("parameter", "1")
    def phi_extent(self) -> Array:
        """Of the width in phi'."""
        return self.phi_max - self.phi_min


@usual_warnings
def image_derivatives(camera: Viewer, images: StarImages) -> ImageDerivatives:
    """Derivatives of place, magnification and travel time of a star's images, by `PARAMETERS`.

    Parameters
    ----------
    camera : Camera
        The one that sees them.
    images : StarImages
        What `star_images` returns for it.

    Returns
    -------
    ImageDerivatives

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `ImageDerivatives.error`: what they change by where N moves by its error, and with fewer steps along the ray. Close
    to a caustic derivatives grow as 1 / |det J|, and errors as its square.

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
    check_camera(camera)
    if not isinstance(images, StarImages):
        raise ValueError(f"Argument `images` must be StarImages, but is {type(images).__name__}.")
    if images.surface.finite:
        raise ValueError(f"Argument `images` must be of a star at infinity, but it is on {images.surface.in_words()}.")
    found = _of_images(camera, images, images.sky, DENSEST)
    sky, logarithm, time = found
    e_1, e_2 = tangent_basis(images.sky)
    others = [_of_images(camera, images, images.sky, _SPARSER)]
    for e in (e_1, e_2):
        moved = images.sky + images.error[:, None] * e
        others.append(_of_images(camera, images, moved, DENSEST))
    error = sum(np.stack([_relative(a - b, b) for a, b in zip(one, found, strict=True)], axis=-1) for one in others)
    magnification = images.magnification[:, None] * logarithm
    return ImageDerivatives(images.star, PARAMETERS, sky, magnification, time, np.asarray(error))


@usual_warnings
def caustic_derivatives(camera: Viewer, orders: int = 3) -> tuple[CausticDerivatives, ...]:
    """Derivatives of cusps and extents of the caustics of order 1 to `orders`, by spin, radius and inclination.

    Parameters
    ----------
    camera : Camera
        Its velocity does not matter to caustics.
    orders : int
        As for `caustics`.

    Returns
    -------
    tuple of CausticDerivatives
        The cusps in the order of those of `caustics`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `CausticDerivatives.error`: as for `image_derivatives`.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> (primary,) = kc.caustic_derivatives(camera, orders=1)
    >>> primary.parameters, primary.cusps.shape
    (('spin', 'radius', 'inclination'), (4, 2, 3))
    """
    check_camera(camera)
    check_orders(orders)
    curves = critical_curves(camera, int(orders), "auto", _TOLERANCE)
    search = curves.search()
    features, places = find_features(search, curves), extreme_places(search, curves)
    rest = camera.at_rest()
    return tuple(
        _of_caustic(rest, curve.order, [p.line_of_sight[0] for p, _ in features[curve.order].cusps], places)
        for curve in curves
    )


def _of_caustic(rest: Viewer, order: int, cusps: list[Array], places: dict) -> CausticDerivatives:
    names = ("theta_min", "theta_max", "phi_min", "phi_max")
    known = [name for name in names if (order, name) in places]
    line_of_sight = [np.array(cusps).reshape(-1, 3), *(places[order, name][0].line_of_sight for name in known)]
    sky = sky_from_fido(rest.frame(), -np.concatenate(line_of_sight))
    moved, sparser = (_of_points(rest, sky, density) for density in (DENSEST, _SPARSER))
    lengths = np.cumsum([len(part) for part in line_of_sight])[:-1]
    error = float(_relative(sparser - moved, moved).max(initial=0.0))
    of_cusps, *pieces = np.split(moved, lengths)
    values = {name: np.full(3, np.nan) for name in names}
    for name, piece in zip(known, pieces, strict=True):
        coefficients = fitted(piece[:, 0 if name.startswith("theta") else 1])
        values[name] = chebyshev.chebval(places[order, name][1], coefficients)
        error = max(error, float(np.abs(coefficients[-3:]).max() / np.abs(coefficients).max()))
    remarks = tuple(f"{name} could not be refined between the points" for name in names if name not in known)
    return CausticDerivatives(order, PARAMETERS[:3], of_cusps, **values, error=error, remarks=remarks)


def _of_points(rest: Viewer, sky: Float[Array, "points 3"], density: float) -> Float[Array, "points 2 3"]:
    """Motion of (theta', phi') of a caustic by the three parameters, its critical curve moving at right angles."""
    values, slopes = _expanded(rest, sky, density)
    gradient = slopes[:, 4, 3:]
    pace = slopes[:, 4, :3] / np.sum(gradient**2, axis=-1, keepdims=True)
    moved = slopes[:, :3, :3] - np.einsum("ijk,ik,il->ijl", slopes[:, :3, 3:], gradient, pace)
    n = values[:, :3]
    angles = np.einsum("kij,ijl->ikl", np.stack(polar_basis(n)), moved)
    angles[:, 1] /= np.hypot(n[:, 0], n[:, 1])[:, None]
    return angles


def _of_images(camera: Viewer, images: StarImages, sky: Float[Array, "images 3"], density: float) -> tuple[Array, ...]:
    """Derivatives of N (n, 3, 5), of ln magnification and of time (n, 5), at directions that show the star."""
    values, slopes = _expanded(camera, sky, density)
    star = from_angles(*images.star)
    e_theta, e_phi = polar_basis(star)
    wish = np.concatenate([-slopes[:, :3, :3], np.zeros((len(sky), 3, 2))], axis=-1)
    wish[:, :, 3] += e_theta
    wish[:, :, 4] += math.sin(images.star[0]) * e_phi
    # Both spheres in bases of their own.
    there, here = (np.stack(basis, axis=-1) for basis in (polar_basis(values[:, :3]), tangent_basis(sky)))
    jacobian = np.einsum("ika,ikl,ilb->iab", there, slopes[:, :3, 3:], here)
    moved = here @ np.linalg.solve(jacobian, np.einsum("ika,ikp->iap", there, wish))
    given = np.concatenate([slopes[:, 3:, :3], np.zeros((len(sky), 2, 2))], axis=-1)
    time, determinant = np.moveaxis(given + slopes[:, 3:, 3:] @ moved, 1, 0)
    return moved, -determinant / values[:, 4:], time


def _relative(change: Array, values: Array) -> Array:
    """The size of a change (n, ...), relative to the values."""
    rows = tuple(range(1, values.ndim))
    return np.abs(change).max(axis=rows) / np.abs(values).max(axis=rows)


def _expanded(camera: Viewer, sky: Float[Array, "rays 3"], density: float) -> tuple[Array, Array]:
    """n', time and det J of rays (n, 5), and their derivatives (n, 5, 6), in batches of one size."""
    place = np.broadcast_to([camera.spin, camera.radius, camera.inclination], sky.shape)
    given = np.concatenate([place, sky], axis=-1)
    motion = motion_of(camera.velocity or "fiducial")
    parts = []
    for start in range(0, len(given), _BATCH):
        part = given[start : start + _BATCH]
        filled = np.concatenate([part, np.repeat(part[:1], _BATCH - len(part), axis=0)])
        parts.append([found[: len(part)] for found in _batch(filled, density, motion)])
    if not parts:
        return np.empty((0, 5)), np.empty((0, 5, 6))
    values, slopes = (np.concatenate(column) for column in zip(*parts, strict=True))
    return values, slopes


@own_settings()
def _batch(given: Float[Array, "rays 6"], density: float, motion: Moving) -> tuple[Array, Array]:
    values, slopes = _expansion(given, motion, density)
    return np.array(values), np.array(slopes)
