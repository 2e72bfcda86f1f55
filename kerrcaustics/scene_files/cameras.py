"""The motion of a scene's camera, from the tables that describe it."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kerrcaustics.orbits.geodesics import Geodesic, free_fall
from kerrcaustics.orbits.motions import Circling, circling
from kerrcaustics.orbits.moving_place import Place, fido_velocity, phi_rate
from kerrcaustics.scene_files.angle_remarks import azimuth_remarks
from kerrcaustics.scene_files.camera_motion import (
    PLACE_NAMES,
    Formulated,
    Splined,
    Staying,
    named,
    read_places,
)
from kerrcaustics.scene_files.camera_tables import CsvTable, ExpressionsTable, GeodesicTable, KeyframesTable
from kerrcaustics.scene_files.contents import Contents
from kerrcaustics.scene_files.expressions import RESERVED, Formula, Moment, check_names, formula
from kerrcaustics.scene_files.table_values import Varied
from kerrcaustics.scene_files.validation import SceneError, reject, table_errors
from kerrcaustics.spacetime.camera import Camera, Velocity
from kerrcaustics.spacetime.observer import Observer
from kerrcaustics.spacetime.viewer import Viewer

# Largest relative change of E, L_z and Q along an accepted geodesic.
_GOOD = 1e-8
# Largest growth of round-off along a geodesic, as a part of the radius: less than a pixel.
_STEADY = 1e-5
# Longest time, M, over which a geodesic is followed: two minutes of computation next to the hole.
_LONGEST_FALL = 1e5
_MOST_DEFINITIONS = 1000
# Largest length of all definitions, characters: reading them takes a second.
_LONGEST_DEFINITIONS = 100_000
CameraMotion = Staying | Splined | Formulated | Geodesic | Circling
"""The places of a camera from a first to a last time, which may be infinite."""


@dataclass(frozen=True)
class CameraPath:
    """The camera of a scene at every time.

    spin: spin of the hole.
    motion: its place at every time.
    velocity: its velocity; None for that of the motion.
    formulas: formulas of the scene by their names.
    distant: True for an `Observer`, who is at rest at each place.
    """

    spin: float
    motion: CameraMotion
    velocity: Velocity | None
    formulas: dict[str, Formula]
    distant: bool

    def camera(self, time: float) -> tuple[Viewer, Place]:
        """The camera, or the observer, at a time, and its place."""
        low, high = self.motion.span
        if not low <= time <= high:
            reject("camera.path", f"reach t = {time:.12g}", f"given from {low:.12g} to {high:.12g}")
        place = self.motion.place(time)
        if not 0 <= place.theta <= math.pi:
            words = f"{math.degrees(place.theta):g} at t = {time:g}"
            reject("camera.path", "keep the inclination in [0, 180] degrees", words)
        try:
            if self.distant:
                return Observer(spin=self.spin, radius=place.radius, inclination=place.theta), place
            # Raises ValueError unless the place is outside the horizon.
            Camera(self.spin, place.radius, place.theta, "fiducial")
            velocity = self.velocity or fido_velocity(self.spin, place)
            if not isinstance(velocity, str) and math.hypot(*velocity) >= 1:
                words = f"{math.hypot(*velocity):.4g} at t = {time:g} (give camera.velocity to look from another)"
                reject("camera.path", "move slower than light", ". ".join([words, *azimuth_remarks(self.motion)]))
            return Camera(self.spin, place.radius, place.theta, velocity), place
        except SceneError:
            raise
        except ValueError as error:
            text = str(error).replace("Argument ", "", 1).replace("`", "")
            raise SceneError(f"camera.path at t = {time:g}: {text}") from None

    def values_at(self, time: float) -> Moment:
        """The values of all names at a time."""
        return Moment(time, self.formulas, named(self.motion.place(time)))


def camera_path(contents: Contents, folder: Path, span: tuple[float, float] | None) -> CameraPath:
    """Return the path of the camera. span: times between which a geodesic is followed; None for its own."""
    formulas = _definitions(contents)
    table, spin, distant = contents.camera, contents.hole.spin, contents.view.size is not None
    velocity = None if table.velocity == "path" else table.velocity
    if table.path is None:
        motion, velocity = _at_rest(contents) if distant else _staying(contents)
        return CameraPath(spin, motion, velocity, formulas, distant)
    match table.path:
        case KeyframesTable(keyframes=keys):
            rows = np.array([[key.time, key.radius, key.inclination_deg, key.azimuth_deg] for key in keys])
            motion = _splined(rows.reshape(-1, 4), "camera.path.keyframes")
        case CsvTable(file=name):
            motion = _of_file(folder / name)
        case ExpressionsTable() as path:
            entries = {name: getattr(path, name) for name in PLACE_NAMES}
            formulas |= {
                name: formula(f"camera.path.{name}", entry) for name, entry in entries.items() if entry != math.inf
            }
            check_names((), formulas, ())
            motion = Formulated(formulas)
        case GeodesicTable() as path:
            motion = _falling(spin, path, span or (path.time, path.time))
    return CameraPath(spin, motion, velocity, formulas, distant)


def varied(entry: str, value: Varied, path: CameraPath) -> "Formula | Splined":
    """Return a value that may change with time: a formula, or a spline of one column."""
    if isinstance(value, tuple):
        rows = np.array([[key.time, key.value, 0.0, 0.0] for key in value]).reshape(-1, 4)
        return _splined(rows, entry)
    expression = formula(entry, value)
    check_names((expression,), path.formulas, PLACE_NAMES)
    return expression


def value_at(varying: "Formula | Splined", moment: Moment) -> float:
    """Return the value of `varied` at a time; a spline is constant before its first and after its last time."""
    if isinstance(varying, Splined):
        return varying.place(min(max(moment.time, varying.span[0]), varying.span[1])).radius
    return moment.value(varying).value


def _definitions(contents: Contents) -> dict[str, Formula]:
    if len(contents.definitions) > _MOST_DEFINITIONS:
        reject("definitions", f"be at most {_MOST_DEFINITIONS}", len(contents.definitions))
    for name in contents.definitions:
        if not name.isidentifier() or name in RESERVED or name in PLACE_NAMES:
            reject("definitions", "have names that are not taken, of letters, digits and _", repr(name))
    size = sum(len(text) for text in contents.definitions.values() if isinstance(text, str))
    if size > _LONGEST_DEFINITIONS:
        reject("definitions", f"be at most {_LONGEST_DEFINITIONS} characters long in all", size)
    formulas = {name: formula(f"definitions.{name}", text) for name, text in contents.definitions.items()}
    check_names((), formulas, PLACE_NAMES)
    return formulas


def _at_rest(contents: Contents) -> tuple[Staying, Velocity]:
    """Return the motion of an observer without a path, who is at rest."""
    table = contents.camera
    theta = math.radians(90.0 if table.inclination_deg is None else table.inclination_deg)
    with table_errors("camera", spin="hole.spin"):
        observer = Observer(spin=contents.hole.spin, radius=table.radius or 0.0, inclination=theta)
    return Staying(Place(observer.radius, theta, math.radians(table.azimuth_deg or 0.0), 0.0, 0.0, 0.0)), "fiducial"


def _staying(contents: Contents) -> tuple[Staying, Velocity]:
    """Return the circular motion of a camera without a path, and its velocity."""
    table, spin = contents.camera, contents.hole.spin
    theta = math.radians(90.0 if table.inclination_deg is None else table.inclination_deg)
    with table_errors("camera", spin="hole.spin"):
        camera = Camera(spin, table.radius or 0.0, theta, table.velocity)
        rate = phi_rate(spin, camera.radius, theta, camera.fido_velocity()[2])
    # Round-off must not move a static camera.
    rate = 0.0 if camera.velocity == "static" else rate
    start = Place(camera.radius, theta, math.radians(table.azimuth_deg or 0.0), 0.0, 0.0, rate)
    return Staying(start), camera.velocity or "fiducial"


def _splined(rows: np.ndarray, entry: str) -> Splined:
    if len(rows) < 2:
        reject(entry, "hold two times or more", f"a list of {len(rows)}")
    for i in np.flatnonzero(np.diff(rows[:, 0]) <= 0).tolist():
        reject(f"{entry}[{i + 1}].time", f"be later than that before it ({rows[i, 0]:g})", float(rows[i + 1, 0]))
    return Splined.through(rows)


def _of_file(path: Path) -> Splined:
    try:
        rows = read_places(path)
    except ValueError as error:
        raise SceneError(f"camera.path.file {error}.") from None
    return _splined(rows, "camera.path.file")


def _falling(spin: float, path: GeodesicTable, span: tuple[float, float]) -> Geodesic | Circling:
    theta, azimuth = math.radians(path.inclination_deg), math.radians(path.azimuth_deg)
    with table_errors("camera.path", spin="hole.spin"):
        if path.velocity == "circular":
            circle = circling(spin, path.radius, theta, azimuth, math.radians(path.heading_deg), path.time)
            return replace(circle, span=(min(path.time, span[0]), max(path.time, span[1])))
        camera = Camera(spin, path.radius, theta, path.velocity)
    longest = max(abs(end - path.time) for end in span)
    if longest > _LONGEST_FALL:
        reject("camera.path", f"be followed over a time of at most {_LONGEST_FALL:g}", longest)
    geodesic = free_fall(camera, azimuth, path.time, span)
    if not geodesic.error < _GOOD:
        reject("camera.path", f"be followed with E, L_z and Q kept to {_GOOD:g}", geodesic.error)
    doubt = float(geodesic.errors(np.array(geodesic.span)).place.max())
    if not doubt < _STEADY:
        must = f"be so stable that rounding grows to less than {_STEADY:g} of its radius"
        reject("camera.path", must, f"such that it grows to {doubt:.1g}: shorten it, or give a circular velocity")
    return geodesic
