"""Units that depend on the viewer and on the surface of the sources.

A quantity whose unit is the name of a role has the unit that follows from the `camera` and the `surface` of its result:
"sky", lengths on the sky of the viewer; "solid angle", areas on it; "place", both coordinates of a surface; "level",
the first of them; "light", flux by luminosity; "flux", either
of the last two, by the source; "source size", a length along a surface, on the celestial sphere an
angle; "magnification", solid angle on the sky by area of the surface.
"""

from dataclasses import replace
from typing import Any

from kerrcaustics.results.declared import Quantity


def magnification_unit(result: Any) -> str:
    """Unit of the magnifications of a result, for people: empty if they are ratios, else "M^2/sr" or "sr/M^2"."""
    return {0: "", 1: "M^2/sr", -1: "sr/M^2"}[_power_of_area(result)]


def _power_of_area(result: Any) -> int:
    """Power of (GM/c^2)^2 in magnifications: area on the viewer's sky by area of the surface."""
    return (result.camera.sky_unit != "rad") - (result.surface.coordinates[0].unit != "rad")


def as_in(result: Any, about: Quantity) -> Quantity:
    """A quantity with the unit, and the name in records, that it has in a result."""
    if about.unit == "sky":
        unit = result.camera.sky_unit
        return replace(about, unit=unit, json=about.name + "_rad" * (unit == "rad"))
    if about.unit == "flux":
        return as_in(result, replace(about, unit="solid angle" if result.source == "spot" else "light"))
    if about.unit == "solid angle":
        return replace(about, unit="sr" if result.camera.sky_unit == "rad" else "(GM/c^2)^2")
    if about.unit == "light":
        return replace(about, unit="c^4/(GM)^2" if result.camera.sky_unit == "rad" else "1")
    if about.unit == "magnification":
        return replace(about, unit={0: "1", 1: "(GM/c^2)^2", -1: "c^4/(GM)^2"}[_power_of_area(result)])
    if about.unit == "source size":
        angle = not result.surface.finite
        return replace(about, unit="rad" if angle else "GM/c^2", json=about.name + "_deg" * angle)
    if about.unit == "place":
        units = [coordinate.unit for coordinate in result.surface.coordinates]
        alike = set(units) == {"rad"}
        # Two names in one: that of angles, and that of other coordinates.
        bases = (about.json or about.name).split()
        base = bases[0] if alike else bases[-1]
        names = [f"{base}_{c.name}" + "_deg" * (c.unit == "rad") for c in result.surface.coordinates]
        return replace(
            about, unit="rad" if alike else ", ".join(units), json=f"{base}_deg" if alike else " ".join(names)
        )
    if about.unit == "level":
        first = result.surface.coordinates[0]
        angle = first.unit == "rad"
        # Without a base the radius would stand under the name of the camera's.
        name = f"{about.json}_{first.name}" if about.json else first.name if angle else about.name
        return replace(about, unit=first.unit, json=name + "_deg" * angle)
    return about
