"""The magnification of a source of finite size: finite at caustics, where that of a point is not."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.extended_sources.arcs.area import Weight
from kerrcaustics.extended_sources.arcs.image_areas import DiscImages, outline_of
from kerrcaustics.extended_sources.charts.charts import Disc
from kerrcaustics.extended_sources.disc_images import disc_images, kinks
from kerrcaustics.extended_sources.nested_discs import RoundSource, integrated, radii_for
from kerrcaustics.extended_sources.profiles import Brightness, Profile, checked_profile
from kerrcaustics.lens_map.arguments import checked_index, checked_place, checked_tolerance, direct_remarks
from kerrcaustics.lens_map.domains import domain_of, search_surface
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import argument_named, quoted, real_number
from kerrcaustics.spacetime.frame import redshift
from kerrcaustics.spacetime.observer import Observer
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

SIZES = 1e-8, 3.1
"""Smallest and largest radius of a source, radians."""
# The largest of one in the plane, as a part of the distance of its centre from the horizon.
_LARGEST_PART = 0.99
# Smallest and largest relative error of the light that may be requested.
_TOLERANCES = 1e-9, 0.1
# Requested relative error of the areas of discs, as a part of that of the light.
_OF_AREA = 1e-4


@result("limb-image/1", record="area error round_hole sky index")
class LimbImage(Shown):
    """The image of a source's limb: a closed curve, which bounds an image of the source or a hole in it.

    Where a caustic crosses the source, the curve passes through folds, and images of two indices meet within it.
    """

    camera: Viewer = quantity("", "", "the viewer", json="", column="")
    surface: End = quantity("", "", "surface on which the source lies", json="", column="")
    sky: Array = quantity(
        "point axis", "1", "directions N along the curve, the first not repeated; of an Observer (alpha, beta)"
    )
    index: Array = quantity("point", "1", "Morse index of the images on the curve")
    area: float = quantity(
        "", "solid angle", "area that the curve adds to the images: negative for a hole or the inner edge of a ring"
    )
    error: float = quantity("", "solid angle", "estimated error of area")
    round_hole: bool = quantity("", "1", "True if the curve runs round the hole, as the edges of rings do")


@result(
    "magnification/1",
    record="camera surface source size power profile max_index total error per_index per_index_error centroid "
    "centroid_error certified remarks",
    points="images",
)
class Magnification(Shown):
    """The light of a source of finite size, relative to that of the same source in empty space."""

    camera: Viewer = quantity("", "", "the viewer", json="", column="")
    surface: End = quantity("", "", "surface on which the source lies", json="", column="")
    source: tuple[float, float] = quantity(
        "angle", "place", "theta', phi' of the source's centre; in the plane r, phi", given=True
    )
    size: float = quantity("", "source size", "radius of the source, along its surface", given=True)
    power: float = quantity("", "1", "power of the frequency ratio g with which the light scales")
    profile: str = quantity("", "", "brightness of the source from the centre to the limb, in words")
    total: float = quantity(
        "", "magnification", "solid angle of all images, weighted by brightness, divided by that of the source"
    )
    error: float = quantity("", "magnification", "estimated error of total")
    per_index: dict[int, float] = quantity(
        "morse_index", "magnification", "contribution of the images of each Morse index to total"
    )
    per_index_error: dict[int, float] = quantity("morse_index", "magnification", "estimated errors of per_index")
    centroid: Array = quantity(
        "axis", "1", "mean direction N of the light; of an Observer the mean (alpha, beta); NaN where there is none"
    )
    centroid_error: float = quantity("", "sky", "estimated error of centroid")
    images: tuple[LimbImage, ...] = quantity("curve", "", "images of the limb, the largest first")
    certified: bool = quantity(
        "",
        "1",
        "True when the boundary of the images is closed, and all images of places in the source lie within it, but "
        "none of places beside the source",
    )
    remarks: tuple[str, ...] = quantity("", "", "remarks on what is in doubt; empty when certified")

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index requested."""
        return max(self.per_index)

    def __repr__(self) -> str:
        """Summary in one line: the source, and how bright it is."""
        note = "" if self.certified else ", not certified"
        bright = f"{self.total:.8g} +- {self.error:.1e}"
        return f"<Magnification of a source of size {self.size:g} at {self.source}: {bright}{note}>"


@usual_warnings
@argument_named("camera", "viewer")
@with_progress
def magnification(
    viewer: Viewer,
    source: ArrayLike,
    size: float,
    *,
    profile: Profile = "uniform",
    max_index: int = 2,
    power: float = 0.0,
    end: Wherever | End = math.inf,
    tolerance: float = 1e-6,
    progress: Progress | bool | None = None,
) -> Magnification:
    """The magnification of a source of finite size, with the images of its limb.

    Parameters
    ----------
    viewer : Camera or Observer
    source : (theta', phi')
        Its centre, radians; in the plane (r, phi).
    size : float
        Its radius: an angle of 1e-8 to 3.1 radians on the celestial sphere; a length in units of the mass elsewhere,
        along the sphere of finite radius on which the source is painted, or in the plane as on a sheet of paper with
        the polar coordinates r and phi. A disc in the plane must lie outside the horizon.
    profile : str, tuple or function
        Brightness from the centre to the limb: "uniform"; ("linear", u) or ("quadratic", u1, u2), limb darkening with
        these coefficients; ("gaussian", width), with the standard deviation (at least 0.2) in radii of the source, cut
        off at the limb; or a function of arrays of the distance from the centre in radii, which may have steps.
    max_index : int
        0 to 6: highest Morse index of the images.
    power : float
        The light scales as the frequency ratio g to this power: 0 for the magnification alone, 4 for the light of all
        frequencies, for sources at rest on the celestial sphere.
    end : float, Sphere or EquatorialPlane
        Radius of the source's sphere; math.inf is the celestial sphere. Spheres within the viewer's radius are seen
        through two arrivals, and the images of both count. An `EquatorialPlane`: images by rays that cross it at the
        source for the n-th time.
    tolerance : float
        Relative error of the light that is aimed at, 1e-9 to 0.1. At 1e-3 sources that are not uniform take half to two
        thirds of the time at 1e-6. The error of a uniform source is mostly much smaller than the tolerance.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    Magnification
        The area of all images divided by that of the source, as for the magnification of `star_images`. The areas are
        solid angles, that of the source about the centre of the sphere on which it lies; on an Observer's screen they
        are in units of the mass squared; for a source in the plane the divisor is its area pi size^2 in r dr dphi.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `Magnification.error`: the distance of the curves from the images of the limb, and the errors of the beams, over the
    whole length of the curves. Small sources need beams of small error: the error grows as 1 / size. For non-uniform
    profiles, also the errors of the sum over radii, and of the polynomials that stand for the profile. It exceeds the
    tolerance where beams or halvings cannot reach that. Images of a higher index than `max_index` are part neither of
    `total` nor of its error.

    Notes
    -----
    The images of the limb are followed through folds; Green's theorem gives the area within. Images of higher index
    than `max_index` are cut off along its critical curve.

    References
    ----------
    Gould & Gaucherel 1997, ApJ 477, 580: magnification as an integral along the images of the limb.
    Schneider, Ehlers & Falco 1992, Gravitational Lenses, 6.4: sources of finite size at folds.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> seen = kc.magnification(camera, source=(1.4, 2.9), size=0.01, max_index=1)
    >>> round(seen.total, 6), seen.certified
    (1.935358, True)
    """
    check_viewer(viewer)
    surface, highest = search_surface(viewer, end), checked_index(max_index)
    place = checked_place("source", source, viewer, surface)
    angle, brightness = _checked_size(size, place, viewer, surface), checked_profile(profile)
    centre = surface.vectors(np.array([place]))[0]
    weight = _weight(power, viewer, surface)
    least = checked_tolerance(tolerance, *_TOLERANCES)
    _check_finite(viewer, Disc(surface, centre, angle))
    whole = disc_images(viewer, surface, centre, angle, highest, weight, tolerance=_OF_AREA * least)
    disc = whole if brightness.is_uniform else _graded(viewer, surface, centre, whole, brightness, weight, least)
    per_solid_angle = 1 / disc.solid_angle
    # Of a source that is not seen there is none.
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = disc.first_moment / (lengths(disc.first_moment) if len(disc.first_moment) == 3 else disc.area)
    spread = float(lengths(whole.points - middle).max(initial=0.0))
    return Magnification(
        camera=viewer,
        surface=surface,
        source=place,
        size=float(size),
        power=float(power),
        profile=brightness.words,
        total=disc.area * per_solid_angle,
        error=disc.error * per_solid_angle,
        per_index=dict(enumerate((disc.shares * per_solid_angle).tolist())),
        per_index_error=dict(enumerate((disc.share_errors * per_solid_angle).tolist())),
        centroid=middle,
        centroid_error=disc.error / disc.area * spread if disc.area else math.nan,
        images=_images(viewer, surface, disc),
        certified=disc.certified,
        remarks=(*direct_remarks(surface, viewer), *disc.remarks),
    )


def _check_finite(viewer: Viewer, disc: Disc) -> None:
    """Raise ValueError if the disc is seen at infinite (alpha, beta): in the direction away from the hole."""
    if not isinstance(viewer, Observer) or math.isinf(viewer.radius):
        return
    away = np.array([[1.0, 0.0, 0.0]])
    ray = beams_of_directions(viewer, away, end=disc.surface.bare(), crossings=False, redshift=False)
    (height,) = disc.height(disc.surface.ends(ray))
    if height <= float(ray.error[0]) * np.max(disc.surface.scale(ray)):
        raise ValueError(
            "Argument `source` must lie farther than `size` from the place that an Observer sees in the direction away "
            "from the hole, whose image on the screen is infinitely large, but lies "
            f"{disc.size + height:.6g} from it; take a Camera at this radius."
        )


def _graded(
    viewer: Viewer,
    surface: End,
    centre: Array,
    whole: DiscImages,
    brightness: Brightness,
    weight: Weight | None,
    least: float,
) -> DiscImages:
    """The same disc with a brightness that is not uniform, as a sum over uniform discs; least: error of the light."""
    index, angle = len(whole.shares) - 1, whole.angle
    touching, remarks = kinks(viewer, surface, centre, angle, index), list(whole.remarks)

    def columns(disc: DiscImages) -> tuple[Array, Array]:
        """Area, shares and moment, and their errors; that of the moment is not needed."""
        values = np.array([disc.area, *disc.shares, *disc.first_moment])
        return values, np.array([disc.error, *disc.share_errors, *np.zeros(len(disc.first_moment))])

    def nested(x: float) -> tuple[Array, Array]:
        disc = disc_images(
            viewer, surface, centre, angle * math.sin(x), index, weight, nested=True, tolerance=_OF_AREA * least
        )
        remarks.extend(disc.remarks)
        return columns(disc)

    source = RoundSource(angle, len(centre) == 2, brightness)
    tolerance = np.full(len(columns(whole)[0]), math.inf)
    tolerance[: index + 2] = least * whole.area * source.light / whole.solid_angle
    light, error = integrated(nested, columns(whole), source, np.arcsin(touching / angle), tolerance, radii_for(least))
    return replace(
        whole,
        solid_angle=source.light,
        area=float(light[0]),
        error=float(error[0]),
        shares=light[1 : index + 2],
        share_errors=error[1 : index + 2],
        first_moment=light[index + 2 :],
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _images(viewer: Viewer, surface: End, disc: DiscImages) -> tuple[LimbImage, ...]:
    images = []
    for bound in sorted(disc.boundaries, key=lambda bound: -abs(bound.area)):
        sky, index = outline_of(disc, bound)
        images.append(LimbImage(viewer, surface, sky, index, bound.area, bound.error, bound.turns != 0))
    return tuple(images)


def _weight(power: object, viewer: Viewer, surface: End) -> Weight | None:
    """The weight of areas on the viewer's sky."""
    number = real_number("power", power)
    if number == 0:
        return None
    if not math.isfinite(number) or surface.finite:
        what = "0 for a source at a finite radius" if surface.finite else "a finite number"
        raise ValueError(f"Argument `power` must be {what}, but is {quoted(power)}.")
    frame = viewer.frame()
    return lambda places: redshift(frame, viewer.directions(places)) ** number


def _checked_size(size: object, place: tuple[float, float], viewer: Viewer, surface: End) -> float:
    """The radius of a source: an angle, radians; in the plane a length."""
    number = real_number("size", size)
    domain, largest = domain_of(surface, viewer), SIZES[1]
    scale, in_plane = domain.radian_length, domain.in_plane
    if in_plane:
        # Within rounding all of the disc lies outside the horizon.
        scale = place[0] - kerr.horizon(viewer.spin)
        largest = _LARGEST_PART
    part = number / scale
    if not SIZES[0] <= part <= largest:
        unit = "units of the mass" if surface.finite else "radians"
        outside = ", so that the disc lies outside the horizon" if in_plane else ""
        raise ValueError(
            f"Argument `size` must be a radius from {SIZES[0] * scale:.3g} to {largest * scale:.3g} {unit}{outside}, "
            f"but is {quoted(size)}."
        )
    return number if in_plane else part
