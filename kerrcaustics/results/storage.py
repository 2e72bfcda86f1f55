"""Results as files: one .npz that loads back equal. Its header is the result as a tree, with its arrays beside it."""

import json
import os
from collections.abc import Callable, Collection
from dataclasses import asdict, fields
from importlib import import_module
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from kerrcaustics.files import OTHER_FORMATS, check_name, check_path, reading, writing
from kerrcaustics.results.archive import LARGEST_HEAD, check_room, read_array, read_head, stand_in
from kerrcaustics.results.declared import LAYOUTS, stored
from kerrcaustics.results.field_types import check_anew, check_fields
from kerrcaustics.results.records import check_result

# Bytes of a file.
_LARGEST = 64_000_000_000
SCHEMA = "kerrcaustics/result/1"

HOMES = {
    "spacetime.camera": "Camera",
    "spacetime.observer": "Observer",
    "beams.beam": "Rays Beams",
    "beams.spheres": "CelestialSphere Sphere",
    "beams.equatorial_plane": "EquatorialPlane",
    "beams.paths": "SpacePoints RayPaths",
    "beams.path_beams": "PathBeams",
    "curves.caustic": "Cusp Caustic CausticSet",
    "tracks.isoradials": "Isoradial IsoradialSet",
    "curves.derivatives": "CausticDerivatives",
    "curves.tubes": "CausticTube",
    "images.images": "StarImages",
    "images.derivatives": "ImageDerivatives",
    "tracks.events": "PairEvent PairEvents",
    "tracks.event_derivatives": "EventDerivatives",
    "tracks.track": "Track",
    "tracks.tracks": "StarTracks",
    "tracks.following": "FollowedStar",
    "images.counts": "ImageCounts CountMap",
    "tracks.circles": "CircleCurve CircleImages",
    "extended_sources.magnification": "LimbImage Magnification",
    "tracks.lines": "LineCrossings",
    "rings.band_edge": "BandEdge",
    "rings.visibility": "Visibilities",
    "rings.results": "RingEdge PhotonBand PhotonRings",
    "waves.amplification": "Amplification",
    "waves.pattern": "DiffractionPattern",
    "light_curves.results": "SourceEvent SpotEvent LightCurve",
    "scenes.view": "View",
    "scenes.screen": "Screen",
    "scenes.footprint": "Footprint",
    "scenes.rendering": "Rendering",
    "scenes.traced_view": "TracedView",
    "scenes.render_volume": "VolumeRendering",
    "scenes.disk.profile": "LineProfile",
    "films.film": "FilmResult",
    "sweeps.run": "SweepResult",
}
"""The classes of each module that a file can hold. A module is loaded for the first file that names one."""

_KINDS = {name for names in HOMES.values() for name in names.split()}

Check = Callable[[Any], None]
GetArray = Callable[[dict[str, Any]], np.ndarray]
"""An array by its entry in a header: the name of its member, its shape and its type."""


def save(path: str | os.PathLike[str], result: Any) -> None:
    """Write a result to one file: NumPy .npz with a JSON header. Nothing is left half-written.

    Parameters
    ----------
    path : str or path
        Name of the file: no ending is added.
    result
        A result of any function of this package, or a tuple of results.

    Raises
    ------
    ValueError
        If `result` is not a result, if its fields are not as declared or hold more than a hundred thousand arrays, if
        `path` has the ending of another format, or if the file cannot be written.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> kc.save("camera.npz", camera)
    >>> kc.load("camera.npz") == camera
    True
    """
    for part in result if isinstance(result, list | tuple) else [result]:
        check_result(part)
    check_path(path)
    if Path(path).suffix.lower() in OTHER_FORMATS:
        raise ValueError(
            f"Argument `path` must not end in {Path(path).suffix}, as this function writes NumPy files (.npz); results "
            "have methods for other formats, such as `to_csv`, and there is `to_xarray`."
        )
    arrays: dict[str, Any] = {}
    tree = _tree(result, arrays)
    _check_loadable(tree)
    head = np.array(json.dumps({"schema": SCHEMA, "result": tree}))
    if head.nbytes > LARGEST_HEAD:
        raise ValueError(f"Argument `result` must fit into one file, but has {len(arrays)} arrays: save it in parts.")
    with writing(path) as file:
        np.savez_compressed(file, allow_pickle=False, head=head, **arrays)


def load(path: str | os.PathLike[str]) -> Any:
    """The result that `save`, or `CountMap.to_fits`, wrote to `path`, equal to the one that was saved.

    The content of a file is checked: fields have the types and dimensions that the result declares, the arguments of a
    camera are valid, and no array is unpacked unless it has the size that the header names.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    ValueError
        If the file cannot be read, or `save` did not write it.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> kc.save("camera.npz", camera)
    >>> kc.load("camera.npz") == camera
    True
    """
    check_name(path)
    if os.fspath(path).lower().endswith((".fits", ".fits.gz")):
        return _kind("CountMap").from_fits(path)
    try:
        with reading(path, _LARGEST) as file, ZipFile(file) as archive:
            head = json.loads(read_head(archive))
            if head["schema"] == SCHEMA:
                return _result(head["result"], archive)
    except OSError as error:
        reason = error.strerror or "it is no such file"
        raise ValueError(f"Argument `path` must name a file that can be read: {os.fspath(path)!r}: {reason}.") from None
    except Exception as error:
        raise ValueError(
            f"Argument `path` must name a file that `kerrcaustics.save` wrote, but {os.fspath(path)!r} is not one."
        ) from error
    raise ValueError(f"Argument `path` must name a file of schema {SCHEMA}, but this one is {head['schema']}.")


def as_json(result: Any) -> str:
    """A result of numbers and texts, such as a camera or a surface, as JSON for the header of another file."""
    return json.dumps({"kind": type(result).__name__, **asdict(result)})


def from_json(text: str, kinds: Collection[str]) -> Any:
    """The result that `as_json` wrote; raise ValueError unless the text is one of these kinds."""
    try:
        parts = json.loads(text)
        name = parts.pop("kind")
        if name in kinds:
            return _kind(name)(**{key: tuple(part) if isinstance(part, list) else part for key, part in parts.items()})
    except (TypeError, KeyError, AttributeError) as error:
        raise ValueError("the text is no result") from error
    raise ValueError(f"a result of kind {name!r} does not belong here")


def _check_loadable(tree: Any) -> None:
    """Raise ValueError for a result that `load` would not read."""
    try:
        _value(tree, lambda entry: stand_in(entry["shape"], entry["dtype"]), check_fields)
    except ValueError as error:
        raise ValueError(f"Argument `result` must hold what it declares, but {error}.") from None


def _result(tree: Any, archive: ZipFile) -> Any:
    """A result, or several, made twice: first of arrays that take no memory, to check types and dimensions."""
    declared: list[np.ndarray] = []

    def as_declared(entry: dict[str, Any]) -> np.ndarray:
        declared.append(stand_in(entry["shape"], entry["dtype"]))
        return declared[-1]

    first = _value(tree, as_declared, check_fields)
    for part in first if isinstance(first, list | tuple) else [first]:
        check_result(part)
    check_room(declared)

    def as_stored(entry: dict[str, Any]) -> np.ndarray:
        return read_array(archive, entry["array"], stand_in(entry["shape"], entry["dtype"]))

    return _value(tree, as_stored, check_anew)


def _tree(value: Any, arrays: dict[str, Any]) -> Any:
    """A value as JSON; arrays are added to `arrays`, and stand in the tree by their names there."""
    if type(value) in LAYOUTS:
        if type(value).__name__ not in _KINDS or not type(value).__module__.startswith("kerrcaustics."):
            raise _not_in_files(type(value).__name__)
        parts = {name: _tree(getattr(value, name), arrays) for name in stored(type(value))}
        return {"kind": type(value).__name__, "fields": parts}
    if isinstance(value, np.ndarray):
        name = f"array_{len(arrays)}"
        arrays[name] = value
        return {"array": name, "shape": list(value.shape), "dtype": value.dtype.str}
    if isinstance(value, dict):
        return {"dict": [[_tree(key, arrays), _tree(part, arrays)] for key, part in value.items()]}
    if isinstance(value, list | tuple):
        return {type(value).__name__: [_tree(part, arrays) for part in value]}
    if isinstance(value, Path):
        return {"path": str(value)}
    if value is None or isinstance(value, str | int | float | np.generic):
        return value.item() if isinstance(value, np.generic) else value
    raise _not_in_files(type(value).__name__)


def _not_in_files(kind: str) -> ValueError:
    """The error about a class that files cannot hold."""
    return ValueError(
        f"Argument `result` must hold classes of kerrcaustics alone, but holds {kind}: a file with a class of your own "
        "could not be loaded; keep its arrays with `numpy.savez`."
    )


def _value(tree: Any, array: GetArray, check: Check) -> Any:
    """The value of a tree that `_tree` made. check: called with each result."""
    if not isinstance(tree, dict):
        if isinstance(tree, list):
            raise ValueError("a list that is not named one")
        return tree
    if "kind" in tree:
        kind = _kind(tree["kind"])
        restored = _restored(kind, {name: _value(part, array, check) for name, part in tree["fields"].items()})
        check(restored)
        return restored
    if "array" in tree:
        return array(tree)
    ((container, inner),) = tree.items()
    if container in ("list", "tuple"):
        parts = [_value(part, array, check) for part in inner]
        return tuple(parts) if container == "tuple" else parts
    if container == "dict":
        return {_value(key, array, check): _value(part, array, check) for key, part in inner}
    return {"path": Path}[container](inner)


def _kind(name: str) -> Any:
    """The class of a result, by its name."""
    (home,) = (module for module, names in HOMES.items() if name in names.split())
    return getattr(import_module(f"kerrcaustics.{home}"), name)


def _restored(kind: Any, parts: dict[str, Any]) -> Any:
    """A result with exactly the stored fields: nothing is rounded again. Fields that files do not hold are None."""
    if parts.keys() != stored(kind).keys():
        raise ValueError(f"{kind.__name__} has other fields")
    restored = object.__new__(kind)
    for field in fields(kind):
        object.__setattr__(restored, field.name, parts.get(field.name))
    return restored
