"""Checks of a scene file, and their errors: one line that names the file, the key by its path, and what it must be."""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

from kerrcaustics.scene_files.contents import Contents, GeodesicTable

# Names of arguments that are keys under another name, in degrees.
_KEYS = {"inclination": "inclination_deg", "field_of_view": "field_of_view_deg", "forward": "look", "up": "look"}
_KEYS |= {"tilt": "galaxy_tilt_deg", "node": "galaxy_node_deg", "centre": "galaxy_centre_deg", "spread": "file"}
_KEYS |= {"path": "file", "light": "file"}
_LARGEST = 16384
_LONGEST = 1e9


class SceneError(ValueError):
    """An error in a scene file, without the name of the file."""


def reject(entry: str, must: str, value: Any) -> NoReturn:
    """Raise ValueError for an entry; value: a number or words."""
    text = f"{value:.12g}" if isinstance(value, float) else value
    raise SceneError(f"{entry} must {must}, but is {text}.")


@contextmanager
def in_file(name: str) -> Iterator[None]:
    """Add the name of the file to errors in it."""
    try:
        yield
    except SceneError as error:
        raise ValueError(f"Scene {name}: {error}") from None


@contextmanager
def about(table: str, **keys: str) -> Iterator[None]:
    """Turn errors about arguments of the package into errors about the keys of a table.

    keys: entries by the names of arguments, for those that come from a key of another name.
    """
    try:
        yield
    except SceneError:
        raise
    except ValueError as error:

        def key(match: re.Match[str]) -> str:
            name = match[1]
            return keys.get(name) or f"{table}.{_KEYS.get(name, name)}"

        text = re.sub(r"^Arguments? ", "", str(error))
        text = re.sub(r"`(\w+)`", key, text)
        raise SceneError(text if text.startswith(table.split(".")[0]) or keys else f"{table}: {text}") from None


def check_numbers(contents: Contents) -> None:
    """Raise ValueError for invalid numbers of a scene, before anything is made of them."""
    if not 0 <= contents.hole.spin < 1:
        reject("hole.spin", "lie in [0, 1)", contents.hole.spin)
    _check_camera(contents)
    _check_view(contents)
    _check_film(contents)
    for i, theta in enumerate(contents.overlays.tracks):
        if not 0 <= theta <= 180:
            reject(f"overlays.tracks[{i}]", "lie in [0, 180] degrees", theta)
    if not 0 <= contents.overlays.critical_curves <= 10:
        reject("overlays.critical_curves", "be a whole number from 0 to 10", contents.overlays.critical_curves)
    for i, one in enumerate(contents.light.flare):
        if (one.file is None) == (one.share is None) or (one.share is None) != (one.width is None):
            reject(f"light.flare[{i}]", "have either share and width, or file", "neither or both")


def _check_camera(contents: Contents) -> None:
    camera = contents.camera
    if (camera.radius is None) == (camera.path is None):
        reject("camera", "have either radius or path", "neither" if camera.path is None else "both")
    if camera.path is not None:
        for key in ("inclination_deg", "azimuth_deg"):
            if getattr(camera, key) is not None:
                reject(f"camera.{key}", "be left out where there is a camera.path", getattr(camera, key))
    for entry, velocity in (("camera", camera.velocity), ("camera.path", getattr(camera.path, "velocity", None))):
        names = ("circular", "fiducial", "static") + ("path",) * (entry == "camera" and camera.path is not None)
        if isinstance(velocity, str) and velocity not in names:
            reject(f"{entry}.velocity", f"be {', '.join(names)} or three numbers", repr(velocity))
    if camera.inclination_deg is not None and not 0 <= camera.inclination_deg <= 180:
        reject("camera.inclination_deg", "lie in [0, 180] degrees", camera.inclination_deg)
    if isinstance(camera.path, GeodesicTable) and not 0 <= camera.path.inclination_deg <= 180:
        reject("camera.path.inclination_deg", "lie in [0, 180] degrees", camera.path.inclination_deg)


def _check_view(contents: Contents) -> None:
    for key in ("width", "height"):
        if not 1 <= getattr(contents.view, key) <= _LARGEST:
            reject(f"view.{key}", f"be a whole number from 1 to {_LARGEST}", getattr(contents.view, key))
    look = contents.view.look
    if isinstance(look, str) and look not in ("hole", "forward"):
        reject("view.look", "be hole, forward or three numbers", repr(look))
    if not isinstance(look, str) and math.hypot(*look) == 0:
        reject("view.look", "be three numbers that are not all zero", list(look))


def _check_film(contents: Contents) -> None:
    film = contents.film
    if film is None:
        return
    if (film.frames is None) == (film.duration is None):
        reject("film", "have either frames or duration", "neither" if film.frames is None else "both")
    for key, least in (("frames", 1), ("rate", 1)):
        value = getattr(film, key)
        if value is not None and not least <= value <= 1_000_000:
            reject(f"film.{key}", f"be a whole number from {least} to 1000000", value)
    for key in ("start", "end"):
        value = getattr(film, key)
        if value is not None and abs(value) > _LONGEST:
            reject(f"film.{key}", f"lie in [{-_LONGEST:g}, {_LONGEST:g}]", value)
    if film.duration is not None and not 0 < film.duration <= 1e5:
        reject("film.duration", "be more than 0 seconds and at most 1e5", film.duration)
    if not 0 <= film.shutter_deg <= 360:
        reject("film.shutter_deg", "lie in [0, 360] degrees", film.shutter_deg)
