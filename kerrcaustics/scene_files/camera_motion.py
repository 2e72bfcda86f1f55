"""The place of a scene's camera at each time."""

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kerrcaustics.files import read_text
from kerrcaustics.orbits.moving_place import Place
from kerrcaustics.scene_files.expressions import Dual, Formula, Moment
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import quoted

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Array = np.ndarray

COLUMNS = ("time", "radius", "inclination_deg", "azimuth_deg")
PLACE_NAMES = COLUMNS[1:]
# Largest file of places, bytes.
_LONGEST = 100_000_000


def named(place: Place) -> dict[str, Dual]:
    """The coordinates of a place as expressions name them, angles in degrees."""
    angles = (place.theta, place.theta_rate), (place.phi, place.phi_rate)
    parts = (Dual(place.radius, place.radius_rate), *(Dual(*map(math.degrees, angle)) for angle in angles))
    return dict(zip(PLACE_NAMES, parts, strict=True))


@dataclass(frozen=True)
class Staying:
    """A camera at constant radius and inclination that circles with an angular velocity."""

    start: Place
    span: tuple[float, float] = (-math.inf, math.inf)

    def place(self, time: float) -> Place:
        """Return the place at a time."""
        return self.start._replace(phi=self.start.phi + self.start.phi_rate * time)


@dataclass(frozen=True)
class Splined:
    """A camera whose coordinates are cubic splines through places at times, with natural ends."""

    times: Float[Array, " n"]
    curve: "CubicSpline"

    @classmethod
    def through(cls, rows: Float[Array, "n 4"]) -> "Splined":
        """The splines through rows of time, radius, inclination and azimuth in degrees; times ascend."""
        from scipy.interpolate import CubicSpline

        times, radius, theta, phi = rows.T
        # 90 degrees become exactly the equator.
        places = np.stack([radius, np.radians(theta), np.radians(phi)], axis=-1)
        return cls(times, CubicSpline(times, places, bc_type="natural"))

    @property
    def span(self) -> tuple[float, float]:
        """First and last time."""
        return float(self.times[0]), float(self.times[-1])

    def place(self, time: float) -> Place:
        """Return the place at a time."""
        return Place(*self.curve(time).tolist(), *self.curve(time, 1).tolist())


@dataclass(frozen=True)
class Formulated:
    """A camera whose coordinates are formulas of time: radius, inclination_deg, azimuth_deg.

    formulas: formulas by their names, other definitions included; without a formula the radius is infinite.
    span: first and last time.
    """

    formulas: dict[str, Formula]
    span: tuple[float, float] = (-math.inf, math.inf)

    def place(self, time: float) -> Place:
        """Return the place at a time."""
        moment = Moment(time, self.formulas)
        radius, theta, phi = (
            moment.value(self.formulas[name]) if name in self.formulas else Dual(math.inf, 0.0) for name in PLACE_NAMES
        )
        values = radius.value, math.radians(theta.value), math.radians(phi.value)
        return Place(*values, radius.rate, math.radians(theta.rate), math.radians(phi.rate))


def read_places(path: Path) -> Float[Array, "n 4"]:
    """Rows (n, 4) of a CSV file with the columns time, radius, inclination_deg, azimuth_deg, by their names."""
    try:
        rows = list(csv.reader(io.StringIO(read_text(path, _LONGEST), newline="")))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise ValueError(f"must name a file that can be read: {path}: {reason}") from None
    rows = [[cell.strip() for cell in row] for row in rows if any(cell.strip() for cell in row)]
    if not rows or sorted(rows[0]) != sorted(COLUMNS):
        must = f"must name a file whose first line is {','.join(COLUMNS)}"
        raise ValueError(f"{must}, but that of {path} {_head_in_words(rows[0] if rows else [])}")
    order = [rows[0].index(name) for name in COLUMNS]
    try:
        values = np.array([[float(row[i]) for i in order] for row in rows[1:]]).reshape(-1, len(COLUMNS))
    except (ValueError, IndexError):
        raise ValueError(f"must name a file with four numbers in each line, but {path} has others") from None
    if not np.isfinite(values).all():
        raise ValueError(f"must name a file with finite numbers, but {path} has others")
    return values


def _head_in_words(head: list[str]) -> str:
    """What is wrong with the first line of a file of places, as the end of a sentence."""
    if len(head) == 1 and ";" in head[0]:
        return "has semicolons: separate columns by commas, and write decimal points"
    lacking, more = [name for name in COLUMNS if name not in head], [name for name in head if name not in COLUMNS]
    if lacking:
        return f"lacks {', '.join(lacking)}"
    return f"has more columns: leave out {', '.join(map(quoted, more or sorted(head)))}"
