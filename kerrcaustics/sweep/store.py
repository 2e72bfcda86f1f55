"""The store of a sweep: one zarr store (version 3), a chunk for a block of points, and a mask of what is done.

A block's chunks are written one after the other, each in one go, the mask last: a block is done when the mask says so
and all its chunks can be read. Every chunk carries a checksum. A point's numbers depend on the point alone, so that a
store that was interrupted, wherever and however often, ends up the same to the bit.
"""

import math
import os
import shutil
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec

from kerrcaustics.sweep.quantities import Variable, dimensions, variables
from kerrcaustics.sweep.scene import AXES, Scene, differences, from_record

Array = np.ndarray

SCHEMA = "kerrcaustics/sweep/1"
WAITING, DONE, FAILED = 0, 1, 2
# Bytes of a reason, UTF-8, and the points of one block at most.
_REASON = 160
_BLOCK = 8
_UNITS = {"spin": "1", "radius": "GM/c^2", "inclination": "degrees"}


@dataclass(frozen=True)
class Block:
    """Points that are computed and stored together: one spin, some radii, one inclination, by number."""

    spin: int
    radii: tuple[int, int]
    inclination: int

    @property
    def region(self) -> tuple[slice, slice, slice]:
        """Where they lie in the arrays."""
        one = slice(self.spin, self.spin + 1), slice(self.inclination, self.inclination + 1)
        return one[0], slice(*self.radii), one[1]


class Store:
    """A store that is open for a scene."""

    def __init__(self, path: Path) -> None:
        """Open a store; a ValueError says what is wrong with it."""
        self.path = path
        try:
            self._group = zarr.open_group(str(path), mode="r+")
            attributes = dict(self._group.attrs)
        except Exception as error:
            raise ValueError(f"The store {path} cannot be opened: {' '.join(str(error).split())}") from None
        if attributes.get("schema") != SCHEMA:
            raise ValueError(f"The store {path} holds {attributes.get('schema', 'no sweep')}, not {SCHEMA}.")
        made = attributes.get("version")
        if made != version("kerrcaustics"):
            raise ValueError(
                f"The store {path} was written by kerrcaustics {made}, and this is {version('kerrcaustics')}: its "
                "numbers may differ. Finish it with that version, or name another store."
            )
        self.scene = from_record(attributes["scene"])
        self._variables = variables(self.scene)

    def blocks(self) -> list[Block]:
        """All blocks, in order."""
        spins, radii, inclinations = self.scene.shape
        size = _block_size(self.scene)
        return [
            Block(i, (j, min(j + size, radii)), k)
            for i in range(spins)
            for k in range(inclinations)
            for j in range(0, radii, size)
        ]

    def is_done(self, block: Block) -> bool:
        """True where the mask says so, and every chunk of the block can be read."""
        try:
            if (self._read("status", block) == WAITING).any():
                return False
            for variable in self._variables:
                self._read(variable.name, block)
            self._read("reason", block)
        except Exception:
            # Whatever is wrong with a chunk, its block is computed again.
            return False
        return True

    def write(self, block: Block, points: list[dict[str, Array] | str]) -> None:
        """Store the points of a block: their values, or why there are none. The mask is written last."""
        shape = [part.stop - part.start for part in block.region]
        status = np.array([FAILED if isinstance(point, str) else DONE for point in points], np.int8).reshape(shape)
        for variable in self._variables:
            values = [_blank(variable, self.scene) if isinstance(p, str) else p[variable.name] for p in points]
            stacked = np.stack([np.asarray(v, variable.dtype) for v in values])
            self._array(variable.name)[block.region] = stacked.reshape(*shape, *stacked.shape[1:])
        reasons = np.stack([_coded(point if isinstance(point, str) else "") for point in points])
        self._array("reason")[block.region] = reasons.reshape(*shape, _REASON)
        self._array("status")[block.region] = status

    def failures(self) -> list[str]:
        """A line for every point that failed: where, and why."""
        status, reason = self._array("status")[...], self._array("reason")[...]
        values = [self.scene.values(axis) for axis in AXES]
        lines = []
        for place in np.argwhere(np.asarray(status) == FAILED):
            spin, radius, inclination = (axis[i] for axis, i in zip(values, place, strict=True))
            text = bytes(np.asarray(reason)[tuple(place)]).rstrip(b"\0").decode(errors="replace")
            lines.append(f"spin {spin:.12g}, radius {radius:.12g}, inclination {inclination:.12g}: {text}")
        return lines

    def _array(self, name: str) -> Any:
        return self._group[name]

    def _read(self, name: str, block: Block) -> Array:
        return np.asarray(self._array(name)[block.region])


def open_store(path: Path, scene: Scene) -> Store:
    """The store at `path`: made when missing, else gone on with; a ValueError when it is of another scene."""
    if not path.exists():
        _create(path, scene)
    store = Store(path)
    different = differences(scene, store.scene)
    if different:
        raise ValueError(f"The store {path} is of another scene; name another store. " + "; ".join(different) + ".")
    # Chunks that were being written when a process was killed.
    for part in path.rglob("*.partial"):
        part.unlink(missing_ok=True)
    return store


def _block_size(scene: Scene) -> int:
    return min(_BLOCK, scene.shape[1])


def _create(path: Path, scene: Scene) -> None:
    """A store with nothing computed, which takes its name when it is complete."""
    made = path.with_name(f".{path.name}.{os.getpid()}.new")
    try:
        group = zarr.open_group(str(made), mode="w", zarr_format=3)
        group.attrs.update(
            {
                "schema": SCHEMA,
                "version": version("kerrcaustics"),
                "title": scene.title,
                "engine": "auto",
                "tolerance": scene.tolerance,
                "scene": scene.record(),
                "description": "Caustics of Kerr black holes. The camera is at phi' = 0; phi' is unwrapped.",
            }
        )
        _create_arrays(group, scene)
        made.rename(path)
    except BaseException:
        shutil.rmtree(made, ignore_errors=True)
        raise


def _create_arrays(group: zarr.Group, scene: Scene) -> None:
    further = dimensions(scene)
    needed = {dim for variable in variables(scene) for dim in variable.dims}
    for name in AXES:
        _coordinate(group, name, scene.values(name), _UNITS[name])
    for name in sorted(needed):
        _coordinate(group, name, further[name], "degrees" if name in ("theta", "phi") else "1")
    chunk = (1, _block_size(scene), 1)
    for variable in variables(scene):
        extra = tuple(len(further[dim]) for dim in variable.dims)
        group.create_array(
            variable.name,
            shape=scene.shape + extra,
            chunks=chunk + extra,
            dtype=variable.dtype,
            fill_value=math.nan if variable.dtype.startswith("float") else -1,
            compressors=[ZstdCodec(level=3), Crc32cCodec()],
            dimension_names=(*AXES, *variable.dims),
            attributes={"units": variable.units, "long_name": variable.text},
            config={"write_empty_chunks": True},
        )
    for name, extra, dims, text in (
        ("status", (), (), "0 not computed, 1 done, 2 failed"),
        ("reason", (_REASON,), ("byte",), "why a point failed: UTF-8, padded with zeros"),
    ):
        group.create_array(
            name,
            shape=scene.shape + extra,
            chunks=chunk + extra,
            dtype="uint8" if extra else "int8",
            fill_value=0,
            compressors=[ZstdCodec(level=3), Crc32cCodec()],
            dimension_names=(*AXES, *dims),
            attributes={"units": "1", "long_name": text},
            config={"write_empty_chunks": True},
        )


def _coordinate(group: zarr.Group, name: str, values: Array, units: str) -> None:
    array = group.create_array(
        name,
        shape=values.shape,
        chunks=values.shape,
        dtype=values.dtype,
        dimension_names=(name,),
        attributes={"units": units},
    )
    array[...] = values


def _blank(variable: Variable, scene: Scene) -> Array:
    further = dimensions(scene)
    fill = math.nan if variable.dtype.startswith("float") else -1
    return np.full([len(further[dim]) for dim in variable.dims], fill, variable.dtype)


def _coded(text: str) -> Array:
    code = text.encode()[:_REASON]
    return np.frombuffer(code.ljust(_REASON, b"\0"), np.uint8)
