"""The files of a store that follow from its scene: the descriptions of its arrays (zarr.json), and its axes.

Descriptions or axes that are lost or altered are therefore mended from the scene. The root holds the scene, under
a checksum of its own; the mask holds a hash of it.
"""

import glob
import hashlib
import json
import math
import re
import secrets
import shutil
import warnings
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec
from zarr.storage import LocalStore, MemoryStore

from kerrcaustics.files import content, make_room, writing
from kerrcaustics.results.declared import Quantity
from kerrcaustics.sweeps.quantities import dimensions, variables
from kerrcaustics.sweeps.scene import AXES, Scene, differences, from_record

Array = np.ndarray

SCHEMA = "kerrcaustics/sweep/1"
# Bytes of a reason, UTF-8.
REASON = 160
_ROOT = "zarr.json"
_STATUS = Quantity("status", (), "1", "0 not computed, 1 done, 2 failed", "int8")
_REASONS = Quantity("reason", ("byte",), "1", "why a point failed: UTF-8, padded with zeros", "uint8")
DIGEST = Quantity("digest", (), "1", "hash of the scene, the place and all values of the point", "uint64")
_UNITS = {"spin": "1", "radius": "GM/c^2", "inclination": "degrees"}
# An unfinished store, beside the finished one.
_UNFINISHED = ".new"


def block_size(scene: Scene) -> int:
    """Radii that are computed together."""
    return min(scene.block, scene.shape[1])


def create(path: Path, scene: Scene) -> None:
    """Make a store with nothing computed, which takes its name when it is complete.

    If several processes make one at once under one name, one of them takes it, and the others vanish.
    """
    unfinished = path.with_name(f".{path.name}.{secrets.token_hex(4)}{_UNFINISHED}")
    try:
        _describe(LocalStore(unfinished), scene)
        unfinished.rename(path)
    except Exception:
        # Another sweep has unfinished the store meanwhile, and may have removed this one.
        if not path.is_dir():
            raise
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def remove_unfinished_stores(path: Path) -> None:
    """Remove the remains of stores whose name another store has taken."""
    beside = path.absolute()
    for unfinished in beside.parent.glob(f".{glob.escape(beside.name)}.*{_UNFINISHED}"):
        if re.fullmatch(r"[0-9a-f]{8}", unfinished.suffixes[-2][1:]):
            shutil.rmtree(unfinished, ignore_errors=True)


def no_store(path: Path) -> ValueError:
    """The error for a path that is no store."""
    return ValueError(f"Argument `path` must name the store of a sweep, or what is not there yet, but {path} is none.")


def root(path: Path) -> Path:
    """The file without which a folder is no store."""
    return path / _ROOT


def moved(path: Path) -> ValueError:
    """The error for a store that vanishes from its path while a sweep writes to it."""
    return ValueError(
        f"The store {path} was moved or removed while the sweep was running. Start the sweep again with its new name: "
        "finished blocks are kept."
    )


def scene_of(path: Path, scene: Scene) -> Scene:
    """Return the scene of the store at `path`, which is `scene` but for its title.

    A root that is lost or altered is no obstacle if the mask belongs to the scene. Raise ValueError for another store.
    """
    attributes, mask = _attributes(path / _ROOT), _attributes(path / _STATUS.name / _ROOT)
    if not attributes or attributes.get("checksum") != _checksum(attributes):
        if mask.get("mark") == mark_of(scene):
            return scene
        _check_schema(path, attributes, mask)
        raise ValueError(
            f"The store {path} is damaged: {path / _ROOT} is lost or altered, and {path / _STATUS.name / _ROOT} does "
            "not say that the store is of this sweep. Name another store."
        )
    stored = scene_in(path, attributes)
    lines = differences(scene, stored)
    if lines:
        raise ValueError(f"The store {path} is of another sweep; name another store. " + "; ".join(lines) + ".")
    return stored


def scene_in(path: Path, attributes: dict[str, Any]) -> Scene:
    """Return the scene in the attributes of a store; raise ValueError for another schema or version."""
    if attributes.get("schema") != SCHEMA:
        raise ValueError(f"The store {path} holds {attributes.get('schema', 'no sweep')}, not {SCHEMA}.")
    written_by = attributes.get("version")
    if written_by != version("kerrcaustics"):
        raise ValueError(
            f"The store {path} was written by kerrcaustics {written_by}, and this is {version('kerrcaustics')}: its "
            "numbers may differ. Finish it with that version, or name another store."
        )
    try:
        return from_record(json.loads(attributes["scene"]))
    except Exception as error:
        raise ValueError(f"The store {path} holds no sweep: {' '.join(str(error).split())}") from None


def mend(path: Path, scene: Scene) -> tuple[str, ...]:
    """Rewrite descriptions and axes that are lost or altered, the root last, and return their names."""
    memory: dict[str, Any] = {}
    _describe(MemoryStore(memory), scene)
    intact = {name: buffer.to_bytes() for name, buffer in memory.items()}
    altered = [name for name in sorted(intact, key=_ROOT.__eq__) if content(path / name) != intact[name]]
    for name in altered:
        make_room(path / name)
        with writing(path / name, lasting=True) as file:
            file.write(intact[name])
    return tuple(altered)


def _check_schema(path: Path, attributes: dict[str, Any], mask: dict[str, Any]) -> None:
    """Raise ValueError for a folder that is no store of a sweep, rather than a damaged one."""
    if attributes.get("schema") != SCHEMA and "mark" not in mask:
        if not content(path / _ROOT):
            raise no_store(path)
        raise ValueError(f"The store {path} holds {attributes.get('schema', 'no sweep')}, not {SCHEMA}.")


def _attributes(path: Path) -> dict[str, Any]:
    """The attributes in a description; none if it is lost or cannot be read."""
    with suppress(ValueError, KeyError, TypeError):
        attributes = json.loads(content(path) or b"")["attributes"]
        return attributes if isinstance(attributes, dict) else {}
    return {}


def mark_of(scene: Scene) -> str:
    """A hash of all that the numbers of a store depend on."""
    return _hash({**scene.record(), "title": "", "version": version("kerrcaustics")})


def _checksum(attributes: dict[str, Any]) -> str:
    return _hash({name: value for name, value in attributes.items() if name != "checksum"})


def _hash(record: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def _describe(store: LocalStore | MemoryStore, scene: Scene) -> None:
    """Create a group with all arrays, and nothing computed, in an empty store."""
    group = zarr.open_group(store, mode="w", zarr_format=3)
    attributes = {
        "schema": SCHEMA,
        "version": version("kerrcaustics"),
        "title": scene.title,
        "engine": "auto",
        "scene": json.dumps(scene.record()),
        "description": "Caustics of Kerr black holes. The camera is at phi' = 0; phi' is unwrapped.",
    }
    group.attrs.update({**attributes, "checksum": _checksum(attributes)})
    _create_arrays(group, scene)
    with warnings.catch_warnings():
        # Readers without this extension of the format read the arrays' own descriptions.
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(store)


def _create_arrays(group: zarr.Group, scene: Scene) -> None:
    coordinates = dimensions(scene)
    used = {dim for variable in variables(scene) for dim in variable.dims}
    for name in AXES:
        _axis(group, name, scene.values(name), _UNITS[name])
    for name in sorted(used):
        _axis(group, name, coordinates[name], "degrees" if name in ("theta", "phi") else "1")
    for variable in variables(scene):
        sizes = tuple(len(coordinates[dim]) for dim in variable.dims)
        _create_array(group, scene, variable, sizes, blank_of(variable.dtype))
    _create_array(group, scene, _STATUS, (), 0, mark=mark_of(scene))
    _create_array(group, scene, _REASONS, (REASON,), 0)
    _create_array(group, scene, DIGEST, (), 0)


def blank_of(dtype: str) -> float:
    """The value that stands for no number."""
    return math.nan if dtype.startswith("float") else -1


def _create_array(
    group: zarr.Group, scene: Scene, about: Quantity, sizes: tuple[int, ...], blank: float, **more: str
) -> None:
    """An array of blanks over all points, in chunks of a block; sizes: of its further dimensions."""
    group.create_array(
        about.name,
        shape=scene.shape + sizes,
        chunks=(1, block_size(scene), 1, *sizes),
        dtype=about.dtype,
        fill_value=blank,
        compressors=[ZstdCodec(level=3), Crc32cCodec()],
        dimension_names=(*AXES, *about.dims),
        attributes={"units": about.unit, "long_name": about.text, **more},
    )


def _axis(group: zarr.Group, name: str, values: Array, units: str) -> None:
    """An axis in one chunk. Readers see blanks if it is lost, and an error if it is altered."""
    array = group.create_array(
        name,
        shape=values.shape,
        chunks=values.shape,
        dtype=values.dtype,
        fill_value=blank_of(str(values.dtype)),
        # Not compressed: the bytes are compared, and may differ between versions of a compressor.
        compressors=[Crc32cCodec()],
        dimension_names=(name,),
        attributes={"units": units},
    )
    array[...] = values
