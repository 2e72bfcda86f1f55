"""Options that commands share, each described once."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import cyclopts
from rich.console import Console

from kerrcaustics.cli.app import BadInput
from kerrcaustics.cli.outputs import check_outputs, write_json
from kerrcaustics.cli.terminal import console, plain_errors

if TYPE_CHECKING:
    from kerrcaustics.beams.ends import EquatorialPlane
    from kerrcaustics.spacetime.camera import Camera
    from kerrcaustics.spacetime.viewer import Viewer


def _whole_number(_type: type, tokens: Sequence[cyclopts.Token]) -> int:
    """The number itself: 2.5 is refused, and not rounded."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise BadInput(f"Argument {tokens[0].keyword} must be a whole number, but is {tokens[0].value}.") from None


def _between(least: int, most: int) -> Callable[[type, Sequence[cyclopts.Token]], int]:
    """What reads a whole number within limits that are known before anything heavy is loaded."""

    def read(kind: type, tokens: Sequence[cyclopts.Token]) -> int:
        number = _whole_number(kind, tokens)
        if not least <= number <= most:
            raise ValueError(f"must be a whole number from {least} to {most}, but is {number}.")
        return number

    return read


def _file_name(_type: type, tokens: Sequence[cyclopts.Token]) -> Path:
    """The path itself; an empty one would be the current folder."""
    if not tokens[0].value:
        raise ValueError("must be a name, but is empty.")
    return Path(tokens[0].value)


_HIGHEST_INDEX = "Highest Morse index, 0 to 6: how often a beam of light was focused to a line on its way."

Flag = Annotated[bool, cyclopts.Parameter(negative=())]
Angle = Annotated[float, cyclopts.Parameter(allow_leading_hyphen=True)]
Angles = Annotated[tuple[float, float], cyclopts.Parameter(allow_leading_hyphen=True)]
FileName = Annotated[Path, cyclopts.Parameter(converter=_file_name)]
"""Of a file or a folder."""

WholeNumber = Annotated[int, cyclopts.Parameter(converter=_whole_number, allow_leading_hyphen=True)]
MaxIndex = Annotated[int, cyclopts.Parameter(converter=_between(0, 6), allow_leading_hyphen=True, help=_HIGHEST_INDEX)]
Orders = Annotated[int, cyclopts.Parameter(converter=_between(1, 10), allow_leading_hyphen=True)]
Crossings = Annotated[int, cyclopts.Parameter(converter=_between(1, 12), allow_leading_hyphen=True)]


@cyclopts.Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """Which camera looks.

    Attributes
    ----------
    spin
        Spin a of the hole, 0 <= a < 1.
    radius
        Boyer-Lindquist radius of the camera, in units of the mass; for `caustics`, `images`,
        `counts` and `tracks` also inf.
    inclination
        Angle of the camera from the spin axis, degrees: 90 is the equator.
    velocity
        Motion of the camera: on a circular geodesic orbit, with the fiducial observer, or static. By default
        circular where there is such an orbit, else fiducial.
    """

    spin: float
    radius: float
    inclination: float = 90.0
    velocity: Literal["circular", "fiducial", "static"] | None = None

    def camera(self) -> "Camera":
        """The camera that the options describe."""
        with plain_errors():
            from kerrcaustics.spacetime.camera import Camera

            return Camera(self.spin, self.radius, self._inclination(), self.velocity)

    def viewer(self) -> "Viewer":
        """The same, or an observer at infinity."""
        if self.radius != math.inf:
            return self.camera()
        if self.velocity not in (None, "fiducial"):
            raise BadInput(f"Argument --velocity must be fiducial at infinity, but is {self.velocity}.")
        with plain_errors():
            from kerrcaustics.spacetime.observer import Observer

            return Observer(spin=self.spin, inclination=self._inclination())

    def _inclination(self) -> float:
        """The inclination in radians."""
        if not 0 <= self.inclination <= 180:
            raise BadInput(f"Argument --inclination must lie in [0, 180] degrees, but is {self.inclination:g}.")
        return math.radians(self.inclination)


@cyclopts.Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SourceOptions:
    """Where the sources lie.

    Attributes
    ----------
    source_radius
        Radius of the sphere that the sources lie on, in units of the mass; left out, the celestial sphere.
    plane
        Instead, sources in the equatorial plane, seen by rays that cross it there for the n-th time: n. The place of a
        source is then r and phi.
    """

    source_radius: float | None = None
    plane: WholeNumber | None = None

    def check(self) -> None:
        """Refuse two places."""
        if self.source_radius is not None and self.plane is not None:
            raise BadInput("Arguments --source-radius, --plane: one of them may be given, but both were.")
        if self.plane is not None and self.plane < 1:
            raise BadInput(f"Argument --plane must be at least 1, but is {self.plane}.")

    def sphere(self) -> float:
        """The radius of the sources, where they lie in no plane."""
        self.check()
        return math.inf if self.source_radius is None else self.source_radius

    def end(self) -> "float | EquatorialPlane":
        """As the functions of the package take it."""
        self.check()
        if self.plane is None:
            return self.sphere()
        from kerrcaustics.beams.ends import EquatorialPlane

        return EquatorialPlane(self.plane)

    def place(self, argument: str, place: tuple[float, float]) -> tuple[float, float]:
        """The place of a source, radians, from what was given in degrees, or as r and degrees."""
        if self.plane is None:
            return radians(argument, place)
        radius, phi = place
        if not (math.isfinite(radius) and math.isfinite(phi)):
            raise BadInput(f"Argument {argument} must be a finite r and phi, but is {radius:g} {phi:g}.")
        return radius, math.radians(phi)


SKY_SOURCES = SourceOptions()
"""The celestial sphere."""


@cyclopts.Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class CommonOptions:
    """Where the numbers go.

    Attributes
    ----------
    json
        Write the numbers to this file as JSON; - is standard output.
    """

    json: Annotated[str | None, cyclopts.Parameter(allow_leading_hyphen=True)] = None

    def check(self, files: dict[str, Path | None] | None = None) -> None:
        """Refuse files that cannot be written: that of --json, and others by their arguments."""
        target = None if self.json in (None, "-") else self.json
        if target == "":
            raise BadInput("Argument --json must be a file name or -, but is empty.")
        if target is not None and target.startswith("-"):
            raise BadInput(f"Argument --json must be a file name or -, but is {target}.")
        check_outputs({**(files or {}), "--json": None if target is None else Path(target)})

    def check_points(self, points: bool) -> None:
        """Refuse --points without --json."""
        if points and self.json is None:
            raise BadInput("Argument --points must come with --json.")

    def console(self) -> Console:
        """Where tables go: to standard error where standard output is for the JSON alone."""
        return console(stderr=self.json == "-")

    def write(self, entry: dict[str, Any], indent: int | None = 2, private: bool = False) -> None:
        """Write a record where --json says; private: into a file that only the user can read."""
        if self.json is not None:
            write_json(entry, self.json, indent, private)

    def write_found(self, entry: dict[str, Any], seconds: float, indent: int | None = 2) -> None:
        """Write the record of a search, with how it was traced and how long it took."""
        self.write({**entry, "engine": "auto", "seconds": seconds}, indent)


COMMON = CommonOptions()
"""No JSON."""


def radians(argument: str, angles: tuple[float, float]) -> tuple[float, float]:
    """Place on the celestial sphere, radians, of theta' and phi' in degrees."""
    theta, phi = angles
    if not 0 <= theta <= 180:
        raise BadInput(f"Argument {argument} must have a theta' in [0, 180] degrees, but it is {theta:g}.")
    if not math.isfinite(phi):
        raise BadInput(f"Argument {argument} must have a finite phi', but it is {phi:g}.")
    return math.radians(theta), math.radians(phi)
