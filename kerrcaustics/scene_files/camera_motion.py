"""The place of a camera at each time, and the velocity of its motion as the fiducial observer measures it."""

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from kerrcaustics.files import read_text
from kerrcaustics.scene_files.expressions import Dual, Formula, Moment
from kerrcaustics.spacetime import kerr

Array = np.ndarray

COLUMNS = ("time", "radius", "inclination_deg", "azimuth_deg")
PLACE_NAMES = COLUMNS[1:]
# Bytes of a file of places.
_LONGEST = 100_000_000


class Place(NamedTuple):
    """Boyer-Lindquist coordinates of a camera (radius, theta, phi in radians), and their rates per coordinate time."""

    radius: float
    theta: float
    phi: float
    radius_rate: float
    theta_rate: float
    phi_rate: float

    def named(self) -> dict[str, Dual]:
        """The coordinates as expressions name them, angles in degrees."""
        angles = (self.theta, self.theta_rate), (self.phi, self.phi_rate)
        parts = (Dual(self.radius, self.radius_rate), *(Dual(*map(math.degrees, angle)) for angle in angles))
        return dict(zip(PLACE_NAMES, parts, strict=True))


@dataclass(frozen=True)
class Staying:
    """A camera that keeps its radius and inclination, and goes round with an angular velocity."""

    start: Place
    span: tuple[float, float] = (-math.inf, math.inf)

    def place(self, time: float) -> Place:
        """Return the place at a time."""
        return self.start._replace(phi=self.start.phi + self.start.phi_rate * time)


@dataclass(frozen=True)
class Splined:
    """A camera whose coordinates are cubic splines through places at times, with natural ends."""

    times: Float[Array, " n"]
    curve: CubicSpline

    @classmethod
    def through(cls, rows: Float[Array, "n 4"]) -> "Splined":
        """The splines through rows of time, radius, inclination and azimuth in degrees; times ascend."""
        times, radius, theta, phi = rows.T
        # At 90 degrees exactly the equator.
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
    """A camera whose coordinates are formulas of time: radius, inclination_deg, azimuth_deg among others.

    Without a formula the radius is infinite.
    """

    formulas: dict[str, Formula]
    span: tuple[float, float] = (-math.inf, math.inf)

    def place(self, time: float) -> Place:
        """Return the place at a time."""
        moment = Moment(time, self.formulas)
        radius, theta, phi = (
            moment.of(self.formulas[name]) if name in self.formulas else Dual(math.inf, 0.0) for name in PLACE_NAMES
        )
        values = radius.value, math.radians(theta.value), math.radians(phi.value)
        return Place(*values, radius.rate, math.radians(theta.rate), math.radians(phi.rate))


def fido_velocity(spin: float, place: Place) -> tuple[float, float, float]:
    """Velocity (v_r, v_theta, v_phi) of a motion as the fiducial observer at its place measures it.

    References: JTFT A.1 for the metric functions; a speed of 1 and more is none that a camera can have.
    """
    cosine, sine = _cosine(place.theta), math.sin(place.theta)
    at = kerr.metric(spin, place.radius, cosine)
    root_sigma = math.sqrt(at.sigma)
    v_r = root_sigma / math.sqrt(at.delta) * place.radius_rate / at.lapse
    v_phi = at.cylindrical_scale * sine * (place.phi_rate - at.shift) / at.lapse
    return v_r, root_sigma * place.theta_rate / at.lapse, v_phi


def phi_rate(spin: float, radius: float, theta: float, v_phi: float) -> float:
    """dphi / dt of a camera whose velocity has the component v_phi, measured by the FIDO; 0 on the axis."""
    at = kerr.metric(spin, radius, _cosine(theta))
    scale = at.cylindrical_scale * math.sin(theta)
    return at.shift + at.lapse * v_phi / scale if scale > 1e-12 else 0.0


def _cosine(theta: float) -> float:
    return 0.0 if theta == math.pi / 2 else math.cos(theta)


def read_places(path: Path) -> Float[Array, "n 4"]:
    """Rows (n, 4) of a CSV file with the columns time, radius, inclination_deg, azimuth_deg, by their names."""
    try:
        rows = list(csv.reader(io.StringIO(read_text(path, _LONGEST), newline="")))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise ValueError(f"must name a file that can be read: {path}: {reason}") from None
    rows = [[cell.strip() for cell in row] for row in rows if any(cell.strip() for cell in row)]
    if not rows or sorted(rows[0]) != sorted(COLUMNS):
        raise ValueError(f"must name a file whose first line is {','.join(COLUMNS)}, but that of {path} is not")
    order = [rows[0].index(name) for name in COLUMNS]
    try:
        values = np.array([[float(row[i]) for i in order] for row in rows[1:]]).reshape(-1, len(COLUMNS))
    except (ValueError, IndexError):
        raise ValueError(f"must name a file with four numbers in each line, but {path} has others") from None
    if not np.isfinite(values).all():
        raise ValueError(f"must name a file with finite numbers, but {path} has others")
    return values
