"""Ends of rays: the celestial sphere, a sphere of finite radius, a crossing of the equatorial plane."""

import math

from kerrcaustics.beams.equatorial_plane import EquatorialPlane
from kerrcaustics.beams.spheres import SKY, CelestialSphere as CelestialSphere, Sphere, Spheres, Spherical
from kerrcaustics.beams.surface import End
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import differing_digits, quoted, real_number
from kerrcaustics.spacetime.viewer import Viewer

Wherever = float | Spherical | EquatorialPlane
"""Values of `end=`: math.inf, a radius, or a surface itself."""


def end_of(camera: Viewer, end: object) -> End:
    """The surface that `end=` means; a ValueError unless it is one outside the horizon."""
    if isinstance(end, Spheres) or (isinstance(end, End) and not isinstance(end, Sphere)):
        return end
    radius = real_number("end", end.radius if isinstance(end, Sphere) else end)
    if math.isnan(radius):
        raise ValueError(f"Argument `end` must be a radius, math.inf or an EquatorialPlane, but is {quoted(end)}.")
    horizon = kerr.horizon(camera.spin)
    if not radius > horizon:
        value, least = differing_digits(radius, horizon)
        raise ValueError(f"Argument `end` must be larger than the horizon radius {least}, but is {value}.")
    if isinstance(end, Sphere):
        return end
    return SKY if math.isinf(radius) else Sphere(radius)
