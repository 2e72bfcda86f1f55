"""The state of the explorer as one value: checked, written as an address, and as commands with the same numbers."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Self
from urllib.parse import urlencode

from kerrcaustics.spacetime.camera import VELOCITY_NAMES, Camera
from kerrcaustics.spacetime.checks import real_number, whole_number

MOST_SPIN = 0.9999
"""Largest spin of the hole."""
MOST_RADIUS = 1000.0
"""Largest radius of the camera, units of the mass."""
MOST_ORDERS = 4
"""Largest number of orders of critical curves."""
"""Limits of a computation: none takes more than some seconds."""

LEAST_RADIUS = 1.0
"""The smallest radius of a horizon: that of extremal spin."""

LEAST_SIZE, MOST_SIZE = 1e-6, 20.0
"""Radii of stars that are not points, degrees."""

LEAST_FREQUENCY, MOST_FREQUENCY = 0.05, 1000.0
"""Angular frequencies of waves, times the mass."""

PAGE = Path(__file__).parent / "page"
"""The files of the page."""

BACKDROPS = ("none", "stars", "checkerboard")
CHARTS = ("map", "unwrapped", "globe")
SPHERES = ("inside", "outside")

CHOICES = {"velocity": VELOCITY_NAMES, "backdrop": BACKDROPS, "chart": CHARTS, "sphere": SPHERES}
"""Values of the fields that are words."""

RANGES = {
    "spin": (0, MOST_SPIN),
    "radius": (LEAST_RADIUS, MOST_RADIUS),
    "inclination": (0, 180),
    "theta": (0, 180),
    "phi": (-36000, 36000),
    "size": (LEAST_SIZE, MOST_SIZE),
    "frequency": (LEAST_FREQUENCY, MOST_FREQUENCY),
}
"""Least and largest numbers; the size and the frequency may be 0, too."""


@dataclass(frozen=True)
class ExplorerState:
    """A camera, a star, the number of orders, and the look of the page.

    spin: spin of the hole.
    radius: radius of the camera, units of the mass.
    inclination: inclination of the camera, degrees.
    velocity: name of the camera's velocity.
    orders: orders of critical curves, 1 to 4, with images of index 0 to orders - 1.
    theta: polar angle of the star on the celestial sphere, degrees.
    phi: azimuth of the star on the celestial sphere, degrees.
    size: radius of the star, degrees, 0 for a point.
    frequency: angular frequency of its waves, times the mass, 0 for rays alone.
    backdrop: the sky behind the curves.
    chart: the chart of the celestial sphere.
    sphere: the side from which the celestial sphere is seen.
    """

    spin: float = 0.5
    radius: float = 6.03
    inclination: float = 90.0
    velocity: str = "circular"
    orders: int = 3
    theta: float = 84.0
    phi: float = 295.0
    size: float = 0.0
    frequency: float = 0.0
    backdrop: str = "none"
    chart: str = "map"
    sphere: str = "inside"

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> Self:
        """A state of values from outside; those left out have their defaults. Raise ValueError if one is wrong."""
        state = cls.read(values)
        state.check()
        return state

    @classmethod
    def read(cls, values: Mapping[str, Any]) -> Self:
        """The state, as by `of`, but the camera may be an impossible one: see `nearest` in `limits.py`."""
        names = sorted(f.name for f in fields(cls))
        for name in values:
            if name not in names:
                raise ValueError(f"Argument `state` must have the keys {', '.join(names)}, but has {name!r:.40}.")
        return cls(**{name: _typed_value(name, value) for name, value in values.items()})

    def check(self) -> None:
        """Raise ValueError unless the state is valid and quick to compute."""
        for name, (least, most) in RANGES.items():
            value = getattr(self, name)
            if value == 0 and name in ("size", "frequency"):
                continue
            if not least <= value <= most:
                raise ValueError(f"Argument `{name}` must lie in [{least:g}, {most:g}], but is {value:.12g}.")
        self.camera()

    def camera(self) -> Camera:
        """The camera."""
        inclination = math.pi / 2 if self.inclination == 90 else math.radians(self.inclination)
        return Camera(self.spin, self.radius, inclination, self.velocity)

    def star(self) -> tuple[float, float]:
        """(theta', phi') of the star, radians."""
        return math.radians(self.theta), math.radians(self.phi)

    @property
    def max_index(self) -> int:
        """Highest Morse index of the images."""
        return self.orders - 1

    def record(self) -> dict[str, Any]:
        """The values by name."""
        return asdict(self)

    def address(self) -> str:
        """The state as the fragment of an address, without the #."""
        return urlencode({name: _text(value) for name, value in self.record().items()})

    def commands(self) -> list[str]:
        """Commands that print these numbers; of deep images with more digits."""
        camera = f"--spin {self.spin:.12g} --radius {self.radius:.12g} --velocity {self.velocity}"
        camera += "" if self.inclination == 90 else f" --inclination {self.inclination:.12g}"
        star = f"--star {self.theta:.12g} {self.phi:.12g}"
        tracks = f"--star-theta {self.theta:.12g}"
        lines = [
            f"kerrcaustics caustics {camera} --orders {self.orders}",
            f"kerrcaustics images {camera} {star} --max-index {self.max_index}",
        ]
        lines += [f"kerrcaustics tracks {camera} {tracks} --max-index {self.max_index}"] * self.has_orbit
        size = f"--size {self.size:.12g} --max-index {self.max_index}"
        lines += [f"kerrcaustics magnification {camera} {star} {size}"] * (self.size > 0)
        waves = f"--frequency {self.frequency:.12g} --max-index {self.max_index}"
        return lines + [f"kerrcaustics amplification {camera} {star} {waves}"] * (self.frequency > 0)

    def python(self) -> str:
        """Python code that returns these numbers; of deep images with more digits."""
        inclination = "math.pi / 2" if self.inclination == 90 else f"math.radians({self.inclination:.12g})"
        star = f"(math.radians({self.theta:.12g}), math.radians({self.phi:.12g}))"
        size = f"size=math.radians({self.size:.12g}), max_index={self.max_index}"
        lines = (
            "import math\nimport kerrcaustics as kc\n\n"
            f"camera = kc.Camera({self.spin:.12g}, {self.radius:.12g}, {inclination}, {self.velocity!r})\n"
            f"caustics = kc.caustics(camera, orders={self.orders})\n"
            f"images = kc.star_images(camera, {star}, max_index={self.max_index})\n"
        )
        lines += f"magnification = kc.magnification(camera, {star}, {size})\n" * (self.size > 0)
        waves = f"{self.frequency:.12g}, max_index={self.max_index}"
        return lines + f"waves = kc.amplification(camera, {star}, {waves})\n" * (self.frequency > 0)

    @property
    def has_orbit(self) -> bool:
        """True when the camera circles the spin axis, so that stars have tracks."""
        return (self.velocity != "static" and self.spin > 0) or self.velocity == "circular"


PRESETS: dict[str, ExplorerState] = {
    "JTFT fig 4: no spin": ExplorerState(spin=0.0, orders=2, theta=80.0, phi=150.0),
    "JTFT fig 5: caustics at r = 6.03": ExplorerState(spin=0.999, theta=84.0, phi=60.0),
    "JTFT fig 6: a pair at r = 6.03": ExplorerState(spin=0.999, orders=2, theta=90.0, phi=300.0),
    "JTFT fig 7: tracks at r = 6.03": ExplorerState(spin=0.999, orders=2, theta=70.0, phi=90.0),
    "JTFT fig 8: stars at r = 2.6": ExplorerState(spin=0.999, radius=2.6, theta=80.0, phi=120.0, backdrop="stars"),
    "JTFT fig 9: caustics at r = 2.6": ExplorerState(spin=0.999, radius=2.6, theta=100.0, phi=120.0),
}
"""States to begin with: those of figures of James, von Tunzelmann, Franklin & Thorne 2015."""


def _typed_value(name: str, value: Any) -> Any:
    """The value as the type that its field has."""
    if name in CHOICES:
        if value not in CHOICES[name]:
            raise ValueError(f"Argument `{name}` must be one of {', '.join(CHOICES[name])}, but is {value!r:.40}.")
        return value
    if name == "orders":
        return whole_number(name, value, 1, MOST_ORDERS)
    number = real_number(name, value)
    if not math.isfinite(number):
        raise ValueError(f"Argument `{name}` must be a finite number, but is {number}.")
    return float(number)


def _text(value: Any) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)
