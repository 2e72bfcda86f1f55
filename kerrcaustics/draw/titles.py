"""Viewers and sources in words, for the titles of plots."""

import math

from kerrcaustics.beams.ends import End
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.spacetime.viewer import Viewer

_MOTIONS = {"circular": "circular orbit", "fiducial": "fiducial observer", "static": "static"}


def viewer_in_words(viewer: Viewer, form: str = ".12g") -> str:
    """Spin, place and motion of a viewer, the radius in a format; a velocity that has no name on a line of its own."""
    inclination = f"inclination {math.degrees(viewer.inclination):.6g} deg"
    if viewer.sky_unit != "rad":
        place = "at infinity" if math.isinf(viewer.radius) else f"at radius {viewer.radius:{form}}"
        return f"spin {viewer.spin:.12g}, observer {place}, {inclination}"
    if isinstance(viewer.velocity, str):
        motion = " " + _MOTIONS[viewer.velocity]
    else:
        motion = "\nvelocity (r, θ, φ) = (" + ", ".join(style.number(v, ".4g") for v in viewer.fido_velocity()) + ")"
    return f"spin {viewer.spin:.12g}, radius {viewer.radius:{form}}, {inclination},{motion}"


def headline(caustics: CausticSet, form: str = ".12g") -> str:
    """The viewer in words, the radius in a format, and the orders that are missing: the title of a figure."""
    missing = ", ".join(style.order_name(order) for order in caustics.lost)
    return viewer_in_words(caustics.camera, form) + f"\nnot found: {missing}" * bool(missing)


def level_in_words(surface: End, level: float) -> str:
    """The first coordinate of a place on a surface: "θ′ = 80 deg", "r = 6"."""
    on_sphere = surface.coordinates[0].unit == "rad"
    return f"θ′ = {math.degrees(level):.12g} deg" if on_sphere else f"r = {level:.12g}"


def place_in_words(surface: End, place: tuple[float, float]) -> str:
    """Both coordinates of a place on a surface: "θ′ = 80 deg, φ′ = −20 deg"."""
    azimuth = style.number(math.degrees(place[1]), ".12g")
    symbol = "φ′" if surface.coordinates[0].unit == "rad" else "φ"
    return f"{level_in_words(surface, place[0])}, {symbol} = {azimuth} deg"
