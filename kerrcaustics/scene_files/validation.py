"""Checks of a scene file, whose errors are one line with the file, the path of the key, and the requirement."""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn, get_args

from kerrcaustics.choices import VelocityName, either
from kerrcaustics.scene_files.camera_tables import CAMERA_VIEW, SCREEN, GeodesicTable, PathTable
from kerrcaustics.scene_files.contents import Contents
from kerrcaustics.scenes.motion import shutter_weight
from kerrcaustics.spacetime.checks import quoted
from kerrcaustics.spacetime.kerr import checked_spin

# Keys of arguments that have another name in scene files.
_KEYS = {"inclination": "inclination_deg", "field_of_view": "field_of_view_deg", "forward": "look", "up": "look"}
_KEYS |= {"tilt": "galaxy_tilt_deg", "node": "galaxy_node_deg", "centre": "galaxy_centre_deg", "spread": "file"}
_KEYS |= {"sky_radius": "radius", "path": "file", "light": "file", "orientation": "orientation_deg"}


class SceneError(ValueError):
    """An error in a scene file, without the name of the file."""


def reject(entry: str, must: str, value: Any) -> NoReturn:
    """Raise ValueError for an entry; value: a number or words."""
    text = f"{value:.12g}" if isinstance(value, float) else value
    raise SceneError(f"{entry} must {must}, but is {text}.")


@contextmanager
def file_errors(name: str) -> Iterator[None]:
    """Add the name of the file to errors in it."""
    try:
        yield
    except SceneError as error:
        raise ValueError(f"Scene {name}: {error}") from None


@contextmanager
def table_errors(table: str, **keys: str) -> Iterator[None]:
    """Turn errors about arguments of the package into errors about the keys of a table.

    keys: entries by the names of arguments, for keys that have other names than their arguments.
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


def check_contents(contents: Contents) -> None:
    """Raise ValueError for entries of a scene that exclude each other, and for missing ones."""
    camera, film = contents.camera, contents.film
    with table_errors("hole"):
        checked_spin(contents.hole.spin)
    _check_either("camera", camera, "radius", "path")
    if camera.path is not None:
        for key in ("inclination_deg", "azimuth_deg"):
            if getattr(camera, key) is not None:
                reject(f"camera.{key}", "be left out where camera.path is given", getattr(camera, key))
    elif camera.velocity == "path":
        must = f"be {either([*get_args(VelocityName), 'three numbers'])} where camera.path is left out"
        reject("camera.velocity", must, "'path'")
    _check_viewer(contents)
    look = contents.view.look
    if look is not None and not isinstance(look, str) and not any(look):
        reject("view.look", "be three numbers that are not all zero", list(look))
    if film is not None:
        _check_either("film", film, "frames", "duration")
        with table_errors("film"):
            shutter_weight("shutter_weight", film.shutter_weight)
    for i, halo in enumerate(contents.light.flare or ()):
        if (halo.file is None) == (halo.share is None) or (halo.share is None) != (halo.width is None):
            reject(f"light.flare[{i}]", "have either share and width, or file", "neither or both")


def _check_viewer(contents: Contents) -> None:
    """Raise ValueError for keys of a camera beside a screen, and of a screen beside a camera."""
    camera, view = contents.camera, contents.view
    infinite = math.inf in (camera.radius, getattr(camera.path, "radius", None))
    if infinite and view.size is None:
        reject("view.size", "be given where camera.radius is inf", "left out")
    excluded_keys, where = (SCREEN, "left out") if view.size is None else (CAMERA_VIEW, "given")
    for key in excluded_keys:
        if getattr(view, key) is not None:
            reject(f"view.{key}", f"be left out where view.size is {where}", quoted(getattr(view, key)))
    if view.size is None:
        return
    where = "where view.size is given (for a fiducial observer)"
    if camera.velocity not in (None, "fiducial"):
        reject("camera.velocity", f"be left out or fiducial {where}", quoted(camera.velocity))
    if isinstance(camera.path, GeodesicTable):
        paths = [str(part.__struct_config__.tag) for part in get_args(PathTable) if part is not GeodesicTable]
        reject("camera.path.kind", f"be {either(paths)} {where}", "'geodesic'")


def _check_either(entry: str, table: Any, first: str, second: str) -> None:
    """Raise ValueError unless a table has exactly one of two keys."""
    absent = [getattr(table, key) is None for key in (first, second)]
    if absent[0] == absent[1]:
        reject(entry, f"have either {first} or {second}", "neither" if absent[0] else "both")
