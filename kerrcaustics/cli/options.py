"""Options that commands share, each described once, with the range of its numbers."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import cyclopts
from rich.console import Console

from kerrcaustics.choices import VelocityName, if_radians, number_suggestion, place_if_radians
from kerrcaustics.cli.endings import BadInput
from kerrcaustics.cli.outputs import check_outputs, write_json
from kerrcaustics.cli.terminal import console, note, one_line_errors, plain_errors, say
from kerrcaustics.files import OTHER_FORMATS

if TYPE_CHECKING:
    from kerrcaustics.beams.ends import EquatorialPlane
    from kerrcaustics.interop.physical_scale import PhysicalScale
    from kerrcaustics.spacetime.viewer import Viewer


def _number(
    kind: Callable[[str], float], least: float = -math.inf, most: float = math.inf, must: str = ""
) -> Callable[[type, Sequence[cyclopts.Token]], float]:
    """Reader of a number in a range, which is checked before anything heavy is loaded.

    must: the words of the message, "be a whole number from `least` to `most`" where left out; 2.5 is not rounded.
    """

    def read(_type: type, tokens: Sequence[cyclopts.Token]) -> float:
        text = tokens[0].value
        try:
            number = kind(text)
        except ValueError:
            end = number_suggestion(text, kind=kind)
            raise ValueError(
                f"must be {'a whole' if kind is int else 'a'} number, but is {text or 'empty'}{end}"
            ) from None
        if not least <= number <= most:
            raise ValueError(f"must {must or f'be a whole number from {least} to {most}'}, but is {number:.12g}.")
        return number

    return read


def _integer_option(*limits: Any, **settings: Any) -> cyclopts.Parameter:
    return cyclopts.Parameter(converter=_number(int, *limits), allow_leading_hyphen=True, **settings)


def _file_name(_type: type, tokens: Sequence[cyclopts.Token]) -> Path:
    """The path itself; an empty one would be the current folder."""
    if not tokens[0].value:
        raise ValueError("must be a name, but is empty.")
    return Path(tokens[0].value)


# Inclinations by default, degrees: for sources in the equatorial plane the camera must not lie in it.
_EQUATOR, _OFF_EQUATOR = 90.0, 60.0

_HIGHEST_INDEX = "Highest Morse index, 0 to 6: the number of times a beam of light was focused to a line on its way."

Flag = Annotated[bool, cyclopts.Parameter(negative=())]
Angle = Annotated[float, cyclopts.Parameter(allow_leading_hyphen=True)]
Angles = Annotated[tuple[float, float], cyclopts.Parameter(allow_leading_hyphen=True)]
FileName = Annotated[Path, cyclopts.Parameter(converter=_file_name)]
"""The name of a file or a folder."""

PolarAngle = Annotated[float, cyclopts.Parameter(converter=_number(float, 0, 180, "lie in [0, 180] degrees"))]
WholeNumber = Annotated[int, _integer_option()]
MaxIndex = Annotated[int, _integer_option(0, 6, help=_HIGHEST_INDEX)]
RingOrder = Annotated[int, _integer_option(0, 9)]
Orders = Annotated[int, _integer_option(1, 10)]
Crossings = Annotated[int, _integer_option(1, 12)]
Crossing = Annotated[int, _integer_option(1, math.inf, "be at least 1")]
Port = Annotated[int, _integer_option(0, 65535, "lie in [0, 65535]")]


@cyclopts.Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """The camera.

    Attributes
    ----------
    spin
        Spin a of the hole, 0 <= a < 1.
    radius
        Boyer-Lindquist radius of the camera, in units of the mass; inf for an observer at infinity.
    inclination
        Angle of the camera from the spin axis, degrees: 90 is the equator. By default 90; 60 if the sources lie in the
        equatorial plane, which the camera must then avoid.
    velocity
        Motion of the camera: on a circular geodesic orbit, with the fiducial observer, or static. By default
        circular if there is such an orbit, else fiducial.
    observer
        An observer at rest instead of a camera, who measures places on the sky by impact parameters (alpha, beta), in
        units of the mass.
    """

    spin: float
    radius: float
    inclination: PolarAngle | None = None
    velocity: VelocityName | None = None
    observer: Flag = False

    def viewer(self, sources_in_plane: bool = False) -> "Viewer":
        """The camera or the observer that the options describe; BadInput for one in the plane of its sources."""
        if self.inclination is not None and (line := if_radians("--inclination", self.inclination)):
            note(line)
        if sources_in_plane and self.inclination is None:
            return self.off_equator().viewer()
        degrees = _EQUATOR if self.inclination is None else self.inclination
        viewer = self._viewer(math.radians(degrees))
        if sources_in_plane and viewer.on_equator:
            raise BadInput(
                f"Argument --inclination must not be {degrees:.12g} degrees, the equatorial plane, as the sources lie "
                f"in that plane: try {_OFF_EQUATOR:g}."
            )
        return viewer

    @property
    def is_observer(self) -> bool:
        """True for an observer, who measures places in units of the mass; False for a camera."""
        return self.observer or self.radius == math.inf

    def off_equator(self) -> "CameraOptions":
        """The same, with the inclination off the equator if none is given."""
        return replace(self, inclination=_OFF_EQUATOR) if self.inclination is None else self

    def _viewer(self, inclination: float) -> "Viewer":
        if not self.is_observer:
            with plain_errors():
                from kerrcaustics.spacetime.camera import Camera

                return Camera(self.spin, self.radius, inclination, self.velocity)
        if self.velocity not in (None, "fiducial"):
            where = "with --observer" if self.observer else "at infinity"
            raise BadInput(f"Argument --velocity must be fiducial {where}, but is {self.velocity}.")
        with plain_errors():
            from kerrcaustics.spacetime.observer import Observer

            return Observer(spin=self.spin, radius=self.radius, inclination=inclination)


@cyclopts.Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SourceOptions:
    """The surface of the sources.

    Attributes
    ----------
    source_radius
        Radius of the sphere on which the sources lie, in units of the mass; by default the celestial sphere.
    plane
        Sources in the equatorial plane instead, seen by rays that cross the plane at the source for the n-th time,
        where n is this number. The place of a source is then r and phi.
    """

    source_radius: float | None = None
    plane: Crossing | None = None

    def end(self) -> "float | EquatorialPlane":
        """The surface as the functions of the package take it."""
        if self.source_radius is not None and self.plane is not None:
            raise BadInput("Arguments --source-radius and --plane: only one of them can be given.")
        if self.plane is None:
            return math.inf if self.source_radius is None else self.source_radius
        from kerrcaustics.beams.ends import EquatorialPlane

        return EquatorialPlane(self.plane)

    @property
    def in_plane(self) -> bool:
        """True for sources in the equatorial plane."""
        return self.plane is not None

    def place(self, argument: str, place: tuple[float, float]) -> tuple[float, float]:
        """The place of a source, radians, from degrees, or from r and degrees; with a note if it looks like radians."""
        if line := self.if_radians(argument, place):
            note(line)
        return self.radians(argument, place)

    def if_radians(self, argument: str, place: tuple[float, float]) -> str:
        """A line about a place whose angles are probably in radians; empty for others."""
        return if_radians(f"phi of {argument}", place[1]) if self.in_plane else place_if_radians(argument, *place)

    def radians(self, argument: str, place: tuple[float, float]) -> tuple[float, float]:
        """The place of a source, radians, from degrees, or from r and degrees."""
        if self.plane is None:
            return _radians(argument, place)
        radius, phi = place
        if not (math.isfinite(radius) and math.isfinite(phi)):
            raise BadInput(f"Argument {argument} must be a finite r and phi, but is {radius:g} {phi:g}.")
        return radius, math.radians(phi)


SKY_SOURCES = SourceOptions()
"""The celestial sphere."""


@cyclopts.Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ScaleOptions:
    """The hole in physical units.

    Attributes
    ----------
    mass
        Mass of the hole in solar masses: tables, figures and films then give times in minutes (in seconds or days if
        one M is much shorter or longer).
    distance
        Distance of the observer in parsecs, with --mass and --observer or --radius inf: tables, figures and films then
        give places on the sky in microarcseconds.
    """

    mass: float | None = None
    distance: float | None = None

    def scale(self, camera: CameraOptions) -> "PhysicalScale | None":
        """The value of one M; BadInput for a distance that nothing uses."""
        if self.distance is not None and self.mass is None:
            raise BadInput("Argument --distance must be used with --mass.")
        if self.distance is not None and not camera.is_observer:
            raise BadInput(
                "Argument --distance must be used with --observer or --radius inf: a camera measures angles."
            )
        if self.mass is None:
            return None
        with plain_errors():
            from kerrcaustics.interop.physical_scale import PhysicalScale

            return PhysicalScale(self.mass, self.distance)


UNITS_OF_MASS = ScaleOptions()
"""Times and places in units of the mass."""


@cyclopts.Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class CommonOptions:
    """The file of the numbers.

    Attributes
    ----------
    json
        Write the numbers to this file as JSON; - is standard output.
    """

    json: Annotated[str | None, cyclopts.Parameter(allow_leading_hyphen=True)] = None

    def check(self, files: dict[str, Path | None] | None = None) -> None:
        """Refuse files that cannot be written: that of --json, and others by their arguments."""
        target = None if self.json in (None, "-") else self.json
        if target is not None and (not target or target.startswith("-")):
            raise BadInput(f"Argument --json must be a file name or -, but is {target or 'empty'}.")
        if target is not None and (ending := Path(target).suffix.lower()) in OTHER_FORMATS and ending != ".json":
            raise BadInput(f"Argument --json must name a file of JSON, such as .json, but is {target}.")
        check_outputs({**(files or {}), "--json": None if target is None else Path(target)})

    def check_points(self, points: bool) -> None:
        """Refuse --points without --json."""
        if points and self.json is None:
            raise BadInput("Argument --points must be used with --json.")

    def console(self) -> Console:
        """The console of tables: standard error where standard output is for the JSON alone."""
        return console(stderr=self.json == "-")

    def say_files(self, **files: Path | None) -> None:
        """Say where the files are that were written besides the JSON."""
        for name, path in files.items():
            if path is not None:
                say(self.console(), f"{name.capitalize()}: {path}")

    def write(self, entry: dict[str, Any], indent: int | None = 2, private: bool = False) -> None:
        """Write a record to the file of --json; private: into a file that only the user can read."""
        if self.json is not None:
            write_json(entry, self.json, indent, private)

    def write_result(self, entry: dict[str, Any], seconds: float, indent: int | None = 2) -> None:
        """Write the record of a search, with how it was traced and how long it took."""
        self.write({**entry, "engine": "auto", "seconds": seconds}, indent)


COMMON = CommonOptions()
"""No JSON."""


@cyclopts.Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class WorkerOptions:
    """The processes that compute.

    Attributes
    ----------
    workers
        Number of processes to use on this machine; by default only one, this process itself.
    scheduler
        Compute on the Dask cluster with this scheduler, such as tcp://host:8786; its workers must see the same files.
    """

    workers: WholeNumber | None = None
    scheduler: str | None = None

    def check(self) -> None:
        """Refuse both, and a number of processes below 1, before anything is read."""
        if self.workers is not None and self.scheduler is not None:
            raise BadInput("Arguments --workers and --scheduler: only one of them can be given.")
        if self.workers is not None and self.workers < 1:
            raise BadInput(f"Argument --workers must be 1 or more, but is {self.workers}.")

    def announce(self) -> None:
        """Say where the dashboard of the cluster is; refuse a scheduler that does not answer."""
        if self.scheduler is None:
            return
        with one_line_errors(), plain_errors():
            from kerrcaustics.workers.places import check_place, dashboard_of

            check_place(self.workers, self.scheduler)
            link = dashboard_of(self.scheduler)
        if link is not None:
            say(console(stderr=True), f"Dashboard: {link}")


HERE = WorkerOptions()
"""No other process."""


def check_degrees(argument: str, degrees: float, least: float, most: float) -> None:
    """Refuse an angle in degrees outside a range that is given in radians."""
    if not least <= math.radians(degrees) <= most:
        limits = f"[{math.degrees(least):.6g}, {math.degrees(most):.6g}]"
        raise BadInput(f"Argument {argument} must lie in {limits} degrees, but is {degrees:.12g}.")


def _radians(argument: str, angles: tuple[float, float]) -> tuple[float, float]:
    """Place on the celestial sphere, radians, of theta' and phi' in degrees."""
    theta, phi = angles
    if not 0 <= theta <= 180:
        raise BadInput(f"Argument {argument} must have a theta' in [0, 180] degrees, but it is {theta:.12g}.")
    if not math.isfinite(phi):
        raise BadInput(f"Argument {argument} must have a finite phi', but it is {phi:g}.")
    return math.radians(theta), math.radians(phi)
