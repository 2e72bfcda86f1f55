"""Units that depend on who looks, and on where the sources lie.

A quantity whose unit is the name of a role has the unit that its result gives it there: the result knows its `camera`
and its `surface`.
"""

from dataclasses import replace
from typing import Any

from kerrcaustics.results.declared import Quantity

ROLES = {
    "sky": "lengths on the sky of the viewer",
    "place": "both coordinates of a surface",
    "level": "the first of them",
    "magnification": "solid angle on the sky by area of the surface",
}
"""The units that are roles."""


def as_in(result: Any, about: Quantity) -> Quantity:
    """A quantity with the unit, and the name in records, that it has in a result."""
    if about.unit == "sky":
        unit = result.camera.sky_unit
        return replace(about, unit=unit, json=about.name + "_rad" * (unit == "rad"))
    if about.unit == "magnification":
        powers = (result.camera.sky_unit != "rad") - (result.surface.coordinates[0].unit != "rad")
        return replace(about, unit={0: "1", 1: "(GM/c^2)^2", -1: "c^4/(GM)^2"}[powers])
    if about.unit in ("place", "level"):
        chosen = result.surface.coordinates[: 1 if about.unit == "level" else 2]
        units = [coordinate.unit for coordinate in chosen]
        names = [coordinate.name + "_deg" * (coordinate.unit == "rad") for coordinate in chosen]
        alike = set(units) == {"rad"}
        name = " ".join(names)
        if about.unit == "place" and alike:
            name = f"{about.json or about.name}_deg"
        elif about.unit == "level" and about.json:
            name = f"{about.json}_{name}"
        return replace(about, unit="rad" if alike else ", ".join(units), json=name)
    return about
