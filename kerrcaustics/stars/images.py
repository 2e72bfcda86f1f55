"""All images of a star, certified: what users keep."""

import math
from dataclasses import replace
from typing import overload

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import SKY, EquatorialPlane, Sphere, Spherical
from kerrcaustics.curves.lens_map import LensMap
from kerrcaustics.curves.search_sky import search_camera, search_sky
from kerrcaustics.curves.source_map import SourceMap, spherical
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.spacetime.checks import numbers, quoted, whole_number
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer, check_viewer
from kerrcaustics.stars.deep_images import deepened, is_deep
from kerrcaustics.stars.far_images import sharpened
from kerrcaustics.stars.plane_images import PlaneImages, plane_images
from kerrcaustics.stars.reciprocal import search_within
from kerrcaustics.stars.rings import on_rings, ring_remark
from kerrcaustics.stars.search import Found, search
from kerrcaustics.stars.sheets import HIGHEST_INDEX, Sheets, sheets_of

Array = np.ndarray

# A source closer to the camera than this part of its radius has no direction: rounding leaves a radian of it open.
_AT_CAMERA = 1e-14

_DIRECT = "the star is seen directly, by an image of index 0, at infinite (alpha, beta): it is not among the images"


@result(
    "images/1",
    record="max_index star source_radius certified per_index expected on_caustic remarks",
    rows="sky azimuth index parity magnification crossings crossings_certain redshift error time "
    "time_error second_arrival",
)
class StarImages:
    """The images of one star, ordered by Morse index."""

    star: tuple[float, float] = quantity("angle", "rad", "theta', phi' of the star", given=True)
    sky: Array = quantity("image axis", "1", "directions N on the camera sky; of an Observer (alpha, beta)")
    azimuth: Array = quantity("image", "rad", "unwrapped phi' of the ray: phi' plus whole turns", json="phi_deg")
    index: Array = quantity("image", "1", "Morse index")
    parity: Array = quantity("image", "1", "(-1)^index")
    magnification: Array = quantity("image", "1", "1 / |det J|; of an Observer (GM/c^2)^2 by solid angle")
    crossings: Array = quantity("image", "1", "crossings of the equatorial plane")
    crossings_certain: Array = quantity(
        "image", "1", "False where crossings may be one off: the star lies in the equatorial plane, within errors"
    )
    redshift: Array = quantity("image", "1", "nu_camera / nu_source")
    error: Array = quantity("image", "rad", "error of sky; of an Observer in GM/c^2", json="error_rad")
    per_index: dict[int, int] = quantity("morse_index", "1", "how many images of each index were found")
    expected: dict[int, int] = quantity(
        "morse_index", "1", "how many there are, from the winding of the caustics about the star"
    )
    on_caustic: tuple[int, ...] = quantity(
        "",
        "1",
        "orders of the caustics that the star cannot be told from: it may have two images more or less, or where the "
        "caustic is a point a ring, which is not among the images",
    )
    certified: bool = quantity("", "1", "True when both counts agree for every index, and the star lies on no caustic")
    remarks: tuple[str, ...] = quantity(
        "",
        "",
        "what is not certain, and what to do about it; certified images of an Observer at infinity may have one, too: "
        "that stars at infinity are seen directly at infinite (alpha, beta)",
        default=(),
    )
    source_radius: float = quantity(
        "", "GM/c^2", "radius of the star, infinite on the celestial sphere", default=math.inf
    )
    time: Array | None = quantity(
        "image", "GM/c^3", "coordinate time from the star to the camera; None for stars at infinity", default=None
    )
    time_error: Array | None = quantity("image", "GM/c^3", "error of time", default=None)
    second_arrival: Array | None = quantity(
        "image",
        "1",
        "of a star within the camera's radius, whether the ray, followed backward, has met the star's sphere before; "
        "None for others",
        default=None,
    )

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index that was asked for."""
        return max(self.per_index)

    def __len__(self) -> int:
        """Number of images."""
        return len(self.index)

    def __repr__(self) -> str:
        """One line: the star, how many images, whether certified."""
        counts = ", ".join(f"{count} of index {k}" for k, count in self.per_index.items())
        return f"<StarImages of star {self.star}: {counts}{'' if self.certified else ', not certified'}>"


@overload
def star_images(
    camera: Viewer, star: tuple[float, float], max_index: int = ..., *, end: EquatorialPlane
) -> PlaneImages: ...
@overload
def star_images(camera: Viewer, star: tuple[float, float], max_index: int = ..., *, end: float = ...) -> StarImages: ...
@usual_warnings
def star_images(
    camera: Viewer, star: tuple[float, float], max_index: int = 2, *, end: float | EquatorialPlane = math.inf
) -> StarImages | PlaneImages:
    """All images of a star with Morse index 0 to `max_index`, brightest orders first.

    Parameters
    ----------
    camera : Camera or Observer
        Its sky is searched once and kept: the next star at the same place costs little.
    star : (theta', phi')
        Radians, on the celestial sphere or the one of `end`; in the plane (r, phi).
    max_index : int
        0 to 6. The image counts need the critical curves to order max_index + 1.
    end : float
        Radius of the star; math.inf is the celestial sphere. One that is nearer to the hole than the camera takes a
        search of its own, as the sky is searched from there (docs/near_sources.md). An `EquatorialPlane`: images by
        rays that cross the plane at the source for the n-th time, seen by cameras that do not lie in it.

    Returns
    -------
    StarImages
        For the plane `PlaneImages`, whose sources have a radius and an azimuth, and no number of images to expect.

    Raises
    ------
    ValueError
        Where an argument cannot be; the message names it, and what it must be.

    Errors
    ------
    `StarImages.error`, round-off of n' divided by the beam's minor diameter; where that is more than 1e-10, as for
    high indices, the image is put right by the distance from the shadow edge (deep_images.py), to about 1e-14, next to
    an extremal hole 1e-15 over the distance of the horizons. Errors hold on the sky of the camera, with aberration.
    Magnification and redshift are those of the beam in the direction that is returned.

    Notes
    -----
    An Observer at infinity sees stars of the celestial sphere directly at infinite (alpha, beta): images of index 0 are
    not among the images then, and `per_index` and `expected` say 0 of them.

    A star in line with a hole without spin and the camera, or on the spin axis with the camera, is seen as rings: these
    are no images of it here. The remarks say which, with their radii; `expected` counts what a star beside it has.

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
    if isinstance(end, EquatorialPlane):
        check_viewer(camera)
        return plane_images(camera, star, checked_index(max_index), end)
    place = checked_place("star", star)
    surface = spherical(camera, end)
    highest = checked_index(max_index)
    check_apart("star", camera, np.array([place]), surface)
    found = search_for(camera, from_angles(*place)[None], np.array([place]), highest, surface)
    return _deepened(images_of(camera, surface, [place], found)[0], found, camera, surface)


def is_within(camera: Viewer, end: Spherical) -> bool:
    """Whether a sphere lies within the camera's radius."""
    return isinstance(end, Sphere) and end.radius < camera.radius


def search_for(camera: Viewer, star: Array, angles: Array, max_index: int, end: Spherical) -> Found:
    """All images of stars (n, 3), whose angles (n, 2) are known too, on a sphere."""
    if isinstance(end, Sphere) and is_within(camera, end):
        return search_within(camera, angles, max_index, end)
    return sharpened(search_sky(camera), search(sheets_of(camera, max_index, end), star), star, end)


def images_of(camera: Viewer, end: Spherical, stars: list[tuple[float, float]], found: Found) -> list[StarImages]:
    """The images that a search for some stars on a sphere found, star by star, as the camera sees them."""
    lens_map = LensMap(camera, end)
    at = lens_map.seen(found.sky, found.second_arrival)
    beams, time, time_error, error = at.beams, at.time, at.time_error, lens_map.errors(found.sky, found.error)
    within = is_within(camera, end)
    notes = (_DIRECT,) if SourceMap(camera, end).unbounded else ()
    images = []
    for i, star in enumerate(stars):
        these = np.flatnonzero(found.star == i)
        orders = tuple(int(k) + 1 for k in np.flatnonzero(found.touching[i]))
        images.append(
            StarImages(
                star=star,
                sky=at.sky[these],
                azimuth=beams.azimuth[these],
                index=found.index[these],
                parity=1 - 2 * (found.index[these] % 2),
                magnification=at.magnification[these],
                crossings=np.asarray(beams.crossings)[these],
                crossings_certain=np.asarray(beams.crossings_certain)[these],
                redshift=at.redshift[these],
                error=error[these],
                per_index=dict(enumerate(found.counts[i].tolist())),
                expected=dict(enumerate(found.expected[i].tolist())),
                on_caustic=orders,
                certified=bool(found.certified[i]),
                remarks=(*notes, *_ring_remarks(camera, end, found.ring[i]), *_remarks(found, i)),
                source_radius=float(end.radius),
                time=None if time is None else time[these],
                time_error=None if time_error is None else time_error[these],
                second_arrival=found.second_arrival[these] if within else None,
            )
        )
    return images


def _deepened(images: StarImages, found: Found, camera: Viewer, end: Spherical) -> StarImages:
    """The same, with those that lie close to the shadow edge to round-off; found: where they were found.

    Refined images are traced anew, so that all that is said of them belongs to their place.
    """
    which = np.flatnonzero(is_deep(found.index, found.error, images.time, images.time_error))
    if len(which) == 0:
        return images
    star = np.tile(from_angles(*images.star), (len(which), 1))
    deep = deepened(search_camera(camera), found.sky[which], found.error[which], star, end, found.second_arrival[which])
    these = which[deep.which]

    def with_deep(values: Array, better: Array | None) -> Array:
        values = values.copy()
        values[these] = better
        return values

    there = replace(found, sky=with_deep(found.sky, deep.sky), error=with_deep(found.error, deep.error))
    (refined,) = images_of(camera, end, [images.star], there)
    turn, phi = 2 * math.pi, images.star[1]
    around = phi + turn * np.round((refined.azimuth[these] - phi) / turn)
    refined = replace(refined, azimuth=with_deep(refined.azimuth, around))
    if refined.time is None or refined.time_error is None:
        return refined
    # N does not tell the time as well as the distance from the shadow edge does.
    time, late = search_sky(camera).viewer_time(deep.time, deep.time_error)
    return replace(refined, time=with_deep(refined.time, time), time_error=with_deep(refined.time_error, late))


def checked_sheets(camera: Viewer, max_index: int, end: float | Spherical = SKY) -> Sheets:
    """The sheets of a camera; bad input is refused with one ValueError."""
    check_viewer(camera)
    return sheets_of(camera, checked_index(max_index), spherical(camera, end))


def checked_index(max_index: int) -> int:
    """A highest index that can be asked for."""
    return whole_number("max_index", max_index, 0, HIGHEST_INDEX)


def checked_stars(stars: ArrayLike, name: str = "stars") -> Float[Array, "stars 3"]:
    """Unit vectors of stars (n, 2) = (theta', phi'), which the user gave as the argument `name`."""
    angles = numbers(name, stars)
    if angles.ndim != 2 or angles.shape[-1] != 2 or not np.isfinite(angles).all():
        raise ValueError(
            f"Argument `{name}` must be an array of finite numbers of shape (n, 2): theta', phi' in radians."
        )
    if ((angles[:, 0] < 0) | (angles[:, 0] > math.pi)).any():
        raise ValueError(f"Argument `{name}` must have theta' in [0, pi] radians (0 to 180 degrees).")
    return from_angles(angles[:, 0], angles[:, 1])


def check_apart(name: str, camera: Viewer, stars: Float[Array, "stars 2"], end: Spherical) -> None:
    """Raise ValueError if a star (theta, phi) of a sphere lies at the camera, where it is seen in no direction.

    name: the argument that the stars are from.
    """
    if not (isinstance(end, Sphere) and math.isfinite(camera.radius)):
        return
    own = from_angles(camera.inclination, 0.0)
    gap = np.hypot(end.radius / camera.radius - 1, np.linalg.norm(from_angles(stars[:, 0], stars[:, 1]) - own, axis=1))
    if (gap < _AT_CAMERA).any():
        raise ValueError(
            f"Argument `{name}` must keep the star away from the camera, but at r = {float(end.radius):.12g}, "
            f"theta = {camera.inclination:.12g}, phi = 0 it cannot be told from that, and is seen in no direction."
        )


def checked_place(name: str, place: object) -> tuple[float, float]:
    """A direction (theta', phi') that the user gave as the argument `name`."""
    angles = numbers(name, place)
    if angles.shape != (2,):
        raise ValueError(f"Argument `{name}` must be two numbers (theta', phi') in radians, but is {quoted(place)}.")
    theta, phi = angles.tolist()
    if not (0 <= theta <= math.pi and math.isfinite(phi)):
        raise ValueError(
            f"Argument `{name}` must have theta' in [0, pi] radians (0 to 180 degrees) and a finite phi', "
            f"but is {quoted(place)}."
        )
    return theta, phi


def _ring_remarks(camera: Viewer, end: Spherical, ring: Bool[Array, " orders"]) -> tuple[str, ...]:
    """Remarks about rings; ring: by order, True where the star lies on a caustic that is a point."""
    if not ring.any():
        return ()
    curves = sheets_of(camera, len(ring) - 1, end).curves
    return tuple(ring_remark(camera, end, curve) for curve in curves if ring[curve.order - 1])


def _remarks(found: Found, star: int) -> tuple[str, ...]:
    """What is not certain about one of the stars, but for rings."""
    counts, expected, coarse = found.counts[star], found.expected[star], found.coarse
    orders = (np.flatnonzero(found.touching[star] & ~found.ring[star]) + 1).tolist()
    remarks = [
        f"the star cannot be told from the caustic of order {order}: it may have two images more, or less; move it by "
        "more than its error"
        for order in orders
    ]
    remarks += [
        f"index {k}: the search found {counts[k]} images, the caustics tell {expected[k]}; "
        + (
            f"its sheet is searched in steps of {math.degrees(coarse[k]):.0f} degrees, as 10 take too long"
            if coarse[k] > 0
            else "move the star or the camera a little and compare"
        )
        for k in np.flatnonzero((counts != expected) & ~on_rings(found.ring[[star]])[0]).tolist()
    ]
    return tuple(remarks)
