"""The amplification of waves of one source: the field at the viewer by that without the hole, finite at caustics."""

import math
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.choices import WaveMethod
from kerrcaustics.images.images import StarImages, star_images
from kerrcaustics.interop.row_tables import FrequencyTable
from kerrcaustics.lens_map.arguments import HIGHEST_INDEX, checked_place
from kerrcaustics.lens_map.domains import leaves_of, search_surface
from kerrcaustics.lens_map.lens_map import TRAVEL_TIME
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.shapes import Complex, Float
from kerrcaustics.spacetime.checks import argument_named, numbers, one_of, quoted, whole_number
from kerrcaustics.spacetime.viewer import Viewer, check_viewer
from kerrcaustics.waves.source_field import source_field
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray

LEAST_FREQUENCY, LARGEST_FREQUENCY = 0.05, 1e100
"""Ray optics says nothing about waves below the first frequency; numbers overflow above the second."""

METHODS = get_args(WaveMethod)


@result(
    "amplification/1",
    record="camera surface source max_index certified remarks image_index image_amplitude image_time",
    rows="frequency real imaginary error method",
)
class Amplification(FrequencyTable):
    """The field of a monochromatic source, with its full phase, in units of its modulus without the hole."""

    camera: Viewer = declared.viewer()
    surface: End = declared.surface()
    source: tuple[float, float] = quantity("angle", "place", "theta', phi' of the source", given=True)
    max_index: int = declared.highest_index()
    frequency: Array = quantity("wave", "c^3/GM", "angular frequency at infinity, times the mass")
    real: Array = quantity("wave", "1", "real part of the field; in GM/c^2 if viewer and source are at infinity")
    imaginary: Array = quantity("wave", "1", "imaginary part")
    error: Array = quantity("wave", "1", "estimated error of the field")
    method: Array = quantity("wave", "1", "method for the brightest part: images, fold, cusp, ring or line")
    image_index: Array = quantity(
        "image", "1", "Morse index n of each image, to one beyond max_index: the last ones may count in the error alone"
    )
    image_amplitude: Array = quantity(
        "image", "1", "g sqrt(mu): the modulus of the image's wave; in the unit of the field"
    )
    image_time: Array = quantity("image", "GM/c^3", TRAVEL_TIME)
    certified: bool = declared.certified("True when no image is missing; on a caustic two of them are one")
    remarks: tuple[str, ...] = declared.remarks("remarks on what is in doubt or left out")

    @property
    def value(self) -> Complex[Array, " n"]:
        """The field (n,), complex; waves go as exp(-i omega t)."""
        return self.real + 1j * self.imaginary

    @property
    def images(self) -> StarImages:
        """The images up to `max_index`, searched for again."""
        return star_images(self.camera, self.source, self.max_index, end=self.surface)

    def __repr__(self) -> str:
        """Summary in one line: the source, and how many frequencies."""
        note = "" if self.certified else ", not certified"
        return f"<Amplification of a source at {self.source}, at {len(self.frequency)} frequencies{note}>"


@usual_warnings
@argument_named("camera", "viewer")
@with_progress
def amplification(
    viewer: Viewer,
    source: ArrayLike,
    frequencies: ArrayLike,
    *,
    max_index: int = 2,
    end: Wherever | End = math.inf,
    method: WaveMethod = "auto",
    progress: Progress | bool | None = None,
) -> Amplification:
    """The amplification of the waves of one source: all images with their phases, finite on caustics.

    Parameters
    ----------
    viewer : Camera or Observer
        Its velocity does not matter: the field is that at its event, for each frequency at infinity.
    source : (theta', phi')
        A point on the sphere of `end`, radians.
    frequencies : array or float
        Angular frequencies at infinity times the mass, 0.05 or more in modulus; negative frequencies give the complex
        conjugate. A wavelength is 2 pi / frequency, in units of the mass.
    max_index : int
        0 to 6: highest Morse index of the images; others that belong to the same ring are included.
    end : float, CelestialSphere or Sphere
        Radius of the source; math.inf is the celestial sphere. A source in the equatorial plane lies on the sphere of
        its radius.
    method : str
        "auto", for each frequency the method with the smallest error; or one method for all frequencies: "images",
        their sum; "fold", pairs beside folds by Airy functions; "cusp", three images within a cusp by Pearcey's
        integral; "ring", pairs across an axis by Bessel functions; "line", one integral for each ring.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    Amplification
        The field in units of the modulus that it has without the hole; waves go as exp(-i omega t). The phase is the
        full one, omega T with the times T of `trace_rays`: multiply by exp(-i omega T_0) for the field relative to a
        wave that takes the time T_0. For an Observer at infinity and the celestial sphere it is the scattering
        amplitude, a length: |f|^2 is the cross section per solid angle, without the incident wave. The strength of a
        source at a finite radius refers to coordinate time, and its field without the hole is that at the flat-space
        distance between the two places, computed from their coordinates: source and viewer may be interchanged.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `Amplification.error`: that of asymptotics falls as 1 / frequency, with a size that partial waves show; that of
    summed pairs falls as the phase between them grows; and that of images of higher index is their amplitude.

    Notes
    -----
    Scalar waves, without polarisation; absorption next to the shadow edge and waves longer than the hole are left out.

    References
    ----------
    Nakamura & Deguchi 1999, Prog. Theor. Phys. Suppl. 133, 137: waves of images, F = sum of sqrt(mu) exp(i omega T - i
    pi n / 2). Ludwig 1966, Comm. Pure Appl. Math. 19, 215: folds. Maslov & Fedoriuk 1981: mixed representations.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> seen = kc.amplification(camera, (1.4, 2.9), [1.0, 10.0], max_index=1)
    >>> seen.method.tolist()
    ['line', 'images']
    """
    check_viewer(viewer)
    surface = search_surface(viewer, end)
    if surface.in_plane:
        raise ValueError(f"Argument `end` must be math.inf or the radius of the source, but is {quoted(end)}.")
    highest = whole_number("max_index", max_index, 0, HIGHEST_INDEX)
    place = checked_place("source", source, viewer, surface)
    omega = _checked_frequencies(frequencies)
    one_of("method", method, METHODS)
    field = source_field(WaveSource(viewer, leaves_of(surface, viewer).surface, place), omega, highest, method)
    return Amplification(
        camera=viewer,
        surface=surface,
        source=place,
        max_index=highest,
        frequency=omega,
        real=np.real(field.value),
        imaginary=np.imag(field.value),
        error=field.error,
        method=field.method,
        image_index=field.images.index,
        image_amplitude=field.images.amplitude,
        image_time=field.images.time,
        certified=field.certified,
        remarks=field.remarks,
    )


def _checked_frequencies(frequencies: ArrayLike) -> Float[Array, " frequencies"]:
    omega = np.atleast_1d(numbers("frequencies", frequencies))
    if omega.ndim != 1 or not len(omega):
        raise ValueError(f"Argument `frequencies` must be a number or a list, but has the shape {omega.shape}.")
    wrong = ~((np.abs(omega) >= LEAST_FREQUENCY) & (np.abs(omega) <= LARGEST_FREQUENCY))
    if wrong.any():
        raise ValueError(
            f"Argument `frequencies` must be finite, and {LEAST_FREQUENCY:g} to {LARGEST_FREQUENCY:g} in modulus, as "
            f"rays say nothing of longer waves, but has {omega[wrong][0]:g}."
        )
    return omega
