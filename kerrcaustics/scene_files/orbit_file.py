"""Orbits in TOML files: the kind of orbit and its numbers, angles in degrees."""

import math
from pathlib import Path
from typing import Annotated, Any

import msgspec

from kerrcaustics.choices import ReleaseName
from kerrcaustics.orbits.orbit import Orbit
from kerrcaustics.toml_files import as_struct, not_finite, read_toml

_PolarAngle = Annotated[float, msgspec.Meta(ge=0, le=180, description="degrees")]


class _GeodesicOrbit(msgspec.Struct, forbid_unknown_fields=True, tag_field="kind", tag="geodesic"):
    """Free fall through a place, as by `Orbit.geodesic`, angles in degrees."""

    radius: float
    theta: _PolarAngle = 90.0
    phi: float = 0.0
    velocity: ReleaseName | tuple[float, float, float] = "circular"
    time: float = 0.0

    def orbit(self) -> Orbit:
        """The orbit that the table describes."""
        theta, phi = math.radians(self.theta), math.radians(self.phi)
        return Orbit.geodesic(self.radius, theta, phi, self.velocity, time=self.time)


class _KeplerOrbit(msgspec.Struct, forbid_unknown_fields=True, tag_field="kind", tag="kepler"):
    """Newton's ellipse, as by `Orbit.kepler`, angles in degrees."""

    semi_major_axis: float
    eccentricity: float = 0.0
    inclination: _PolarAngle = 0.0
    node: float = 0.0
    pericentre: float = 0.0
    time: float = 0.0

    def orbit(self) -> Orbit:
        """The orbit that the table describes."""
        angles = (math.radians(angle) for angle in (self.inclination, self.node, self.pericentre))
        return Orbit.kepler(self.semi_major_axis, self.eccentricity, *angles, time=self.time)


def read_orbit(path: str | Path) -> Orbit:
    """The orbit in a TOML file; a ValueError of one line names the invalid entry."""
    table = read_toml(path, "orbit")
    for entry, value in not_finite(table):
        raise ValueError(f"Orbit {path}: {entry} must be a finite number, but is {value:g}.")
    kind: Any = _GeodesicOrbit | _KeplerOrbit
    return as_struct(table, kind, path, "orbit").orbit()
