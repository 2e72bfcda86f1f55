"""A sweep: its quantities and its cameras. Read from a sweep file (TOML); unknown entries raise ValueError."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np

from kerrcaustics.choices import VelocityName
from kerrcaustics.shapes import Float
from kerrcaustics.toml_files import as_struct, read_toml

Array = np.ndarray
Quantity = Literal["geometry", "cusps", "areas", "curves", "counts", "magnification"]
Spacing = Literal["linear", "log"]
Complaint = tuple[str, str, Any]
"""An entry of a sweep, the values it may have, and its value."""

AXES = ("spin", "radius", "inclination")
HIGHEST_ORDER = 10
"""Highest order of caustics."""
HIGHEST_COUNTED = 7
"""Highest order of caustics where counts are computed."""
MOST_POINTS = 4_000_000
"""Largest number of points of a sweep."""
_RANGES = {
    "orders": (1, HIGHEST_ORDER),
    "curve_points": (8, 100_000),
    "map_rows": (4, 2000),
    "directions": (64, 10_000_000),
    "block": (1, 10_000),
}
_LIMITS = {"spin": "in [0, 1)", "radius": "more than 0 and finite", "inclination": "in [0, 180] degrees"}


class Range(msgspec.Struct, forbid_unknown_fields=True, frozen=True, rename={"start": "from", "end": "to"}):
    """Values from `start` to `end`, both included: in TOML {from = 2, to = 1000, count = 20, spacing = "log"}."""

    start: float
    end: float
    count: int
    spacing: Spacing = "linear"


class Scene(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The cameras and the quantities of a sweep.

    spin: at least 0, below 1: a number, a list, or `{from, to, count, spacing}` with both ends included, and a spacing
        `"linear"`, which is the default, or `"log"`.
    radius: of the camera, in units of the mass, likewise.
    inclination: angle of the camera from the spin axis, degrees, likewise.
    velocity: of the camera; unless given, circular if there is such an orbit, else fiducial.
    orders: highest order of the caustics, from 1 to 10; at most 7 with counts.
    compute: the quantities in the store.
    curve_points: maximum number of stored points per curve.
    map_rows: rows of the maps of image counts, from pole to pole; there are twice as many columns.
    directions: directions on the camera sky for the statistics of the magnification.
    block: number of radii computed together and stored in one chunk.
    title: for readers.
    """

    spin: float | list[float] | Range
    radius: float | list[float] | Range
    inclination: float | list[float] | Range = 90.0
    velocity: VelocityName | None = None
    orders: int = 3
    compute: tuple[Quantity, ...] = ("geometry", "cusps", "areas")
    curve_points: int = 256
    map_rows: int = 32
    directions: int = 8192
    block: int = 8
    title: str = ""

    def values(self, axis: str) -> Float[Array, " values"]:
        """The values along "spin", "radius" or "inclination", in ascending order."""
        entry = getattr(self, axis)
        if isinstance(entry, Range):
            space = np.geomspace if entry.spacing == "log" else np.linspace
            return space(entry.start, entry.end, entry.count)
        return np.sort(np.atleast_1d(np.asarray(entry, float)))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of spins, radii and inclinations."""
        spins, radii, inclinations = (len(self.values(axis)) for axis in AXES)
        return spins, radii, inclinations

    def record(self) -> dict[str, Any]:
        """The sweep as plain data, from which `from_record` makes it again."""
        return msgspec.to_builtins(self)


HOLDS = "sweep file"
"""What the file of a sweep is called in messages."""


def read_scene(path: str | Path) -> Scene:
    """The sweep in a TOML file; a ValueError of one line names what is wrong and where."""
    return checked(as_struct(read_toml(path, HOLDS), Scene, path, HOLDS), f"Sweep file {path}")


def from_record(record: dict[str, Any]) -> Scene:
    """The sweep of the data that `Scene.record` returned."""
    return checked(msgspec.convert(record, Scene), "The sweep of the store")


def differences(scene: Scene, stored: Scene) -> list[str]:
    """Lines for the entries in which a sweep and a stored one differ, titles aside: the value in each."""
    first, second = scene.record(), stored.record()
    return [
        f"{name}: {json.dumps(first[name])} here, {json.dumps(second[name])} in the store"
        for name in first
        if first[name] != second[name] and name != "title"
    ]


def checked(scene: Scene, name: str) -> Scene:
    """The sweep itself; a ValueError of one line, which begins with `name`, gives an invalid entry."""
    for complaints in (_about_axes, _about_entries):
        for entry, must, value in complaints(scene):
            raise ValueError(f"{name}: {entry} must be {must}, but is {value}.")
    return scene


def _about_axes(scene: Scene) -> Iterator[Complaint]:
    for axis in AXES:
        entry = getattr(scene, axis)
        if isinstance(entry, Range):
            if not 1 <= entry.count <= MOST_POINTS:
                yield f"{axis}.count", f"from 1 to {MOST_POINTS}", entry.count
            if entry.spacing == "log" and not (entry.start > 0 and entry.end > 0):
                yield f"{axis}.from and {axis}.to", "more than 0 for log spacing", _as_typed(entry)
        values = scene.values(axis)
        inside = {"spin": (values >= 0) & (values < 1), "radius": values > 0}.get(axis, (values >= 0) & (values <= 180))
        inside &= np.isfinite(values)
        if not len(values):
            yield axis, "a list of one value or more", _as_typed(entry)
        if not inside.all():
            yield axis, _LIMITS[axis], ", ".join(map(str, values[~inside].tolist()[:3]))
        if (np.diff(values) <= 0).any():
            yield axis, "values that differ, from the least to the largest", _as_typed(entry)


def _as_typed(axis: float | list[float] | Range) -> str:
    """An axis as written in a sweep file."""
    if not isinstance(axis, Range):
        return str(axis)
    spacing = f', spacing = "{axis.spacing}"' if axis.spacing != "linear" else ""
    return f"{{from = {axis.start:.12g}, to = {axis.end:.12g}, count = {axis.count}{spacing}}}"


def _about_entries(scene: Scene) -> Iterator[Complaint]:
    for entry, (low, high) in _RANGES.items():
        if not low <= getattr(scene, entry) <= high:
            yield entry, f"from {low} to {high}", getattr(scene, entry)
    if not scene.compute or len(set(scene.compute)) < len(scene.compute):
        yield "compute", "a list of different quantities", list(scene.compute)
    if "counts" in scene.compute and scene.orders > HIGHEST_COUNTED:
        yield "orders", f"{HIGHEST_COUNTED} at most where counts are computed", scene.orders
    if math.prod(scene.shape) > MOST_POINTS:
        yield "the number of points", f"{MOST_POINTS} at most", math.prod(scene.shape)
