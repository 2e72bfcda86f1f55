"""The store of a sweep: one zarr store (version 3), a chunk for a block of points, and a mask of what is done.

A block's chunks are written one after the other, each in one go, the mask last: a block is done when the mask says so
and all its chunks can be read. Every chunk carries a checksum. A point's numbers depend on the point alone, so that a
store that was interrupted, wherever and however often, ends up the same to the bit.
"""

import json
import math
import shutil
import warnings
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from jaxtyping import UInt8
from zarr.codecs import Crc32cCodec, ZstdCodec

from kerrcaustics.files import locked
from kerrcaustics.results.declared import Quantity
from kerrcaustics.sweeps.quantities import dimensions, variables
from kerrcaustics.sweeps.scene import AXES, Scene, differences, from_record

Array = np.ndarray

SCHEMA = "kerrcaustics/sweep/1"
WAITING, DONE, FAILED = 0, 1, 2
# What there is of a block.
KEPT, OPEN, DAMAGED = "kept", "open", "damaged"
# Bytes of a reason, UTF-8.
_REASON = 160
_STATUS = Quantity("status", (), "1", "0 not computed, 1 done, 2 failed", "int8")
_REASONS = Quantity("reason", ("byte",), "1", "why a point failed: UTF-8, padded with zeros", "uint8")
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

    def __len__(self) -> int:
        """How many points."""
        return self.radii[1] - self.radii[0]


class Store:
    """A store that is open for a scene."""

    def __init__(self, path: Path) -> None:
        """Open a store; a ValueError says what is wrong with it."""
        self.path = path
        try:
            self._group = zarr.open_group(str(path), mode="r+")
            attributes: dict[str, Any] = dict(self._group.attrs)
        except Exception:
            raise ValueError(
                f"Argument `path` must name the store of a sweep, or what is not there yet, but {path} is none."
            ) from None
        if attributes.get("schema") != SCHEMA:
            raise ValueError(f"The store {path} holds {attributes.get('schema', 'no sweep')}, not {SCHEMA}.")
        made = attributes.get("version")
        if made != version("kerrcaustics"):
            raise ValueError(
                f"The store {path} was written by kerrcaustics {made}, and this is {version('kerrcaustics')}: its "
                "numbers may differ. Finish it with that version, or name another store."
            )
        try:
            self.scene = from_record(json.loads(attributes["scene"]))
        except Exception as error:
            raise ValueError(f"The store {path} tells no scene: {' '.join(str(error).split())}") from None
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

    def locked(self) -> AbstractContextManager[None]:
        """While no other sweep writes to this store; the lock goes with the process, however that ends."""
        return locked(self.path, f"The store {self.path} is in use: another sweep is writing to it.")

    def clean(self) -> None:
        """Remove chunks that were being written when a process was killed."""
        for part in self.path.rglob("*.partial"):
            part.unlink(missing_ok=True)

    def state(self, block: Block, retry: bool = False) -> str:
        """KEPT where the mask says that the block is done, and every chunk of it can be read.

        Else OPEN, as where a point failed that is to be tried again; DAMAGED where it was done once.
        """
        try:
            if not self._chunk("status", block).is_file():
                return OPEN
            status = self._read("status", block)
            if (status == WAITING).any() or (retry and (status == FAILED).any()):
                return OPEN
            for name in (*(variable.name for variable in self._variables), "reason"):
                self._read(name, block)
        except Exception:
            # Whatever is wrong with a chunk, its block is computed again.
            return DAMAGED
        return KEPT

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
        # Blank chunks are written too: only then a chunk that is not there is known to be lost.
        return self._group[name].with_config({"write_empty_chunks": True})  # pyright: ignore

    def _read(self, name: str, block: Block) -> Array:
        # A chunk that is not there would be read as blanks.
        if not self._chunk(name, block).is_file():
            raise FileNotFoundError(name)
        return np.asarray(self._array(name)[block.region])

    def _chunk(self, name: str, block: Block) -> Path:
        """The file of a chunk."""
        array = self._array(name)
        place = [part.start // size for part, size in zip(block.region, array.chunks, strict=False)]
        place += [0] * (array.ndim - len(place))
        return self.path / name / array.metadata.encode_chunk_key(tuple(place))


def open_store(path: Path, scene: Scene) -> Store:
    """The store at `path`: made when missing, else gone on with; a ValueError when it is of another scene."""
    if not path.exists():
        if not path.absolute().parent.is_dir():
            raise ValueError(f"Argument `path` must lie in a folder that exists, but {str(path.parent)!r} is none.")
        _create(path, scene)
    store = Store(path)
    different = differences(scene, store.scene)
    if different:
        raise ValueError(f"The store {path} is of another scene; name another store. " + "; ".join(different) + ".")
    return store


def _block_size(scene: Scene) -> int:
    return min(scene.block, scene.shape[1])


def _create(path: Path, scene: Scene) -> None:
    """A store with nothing computed, which takes its name when it is complete."""
    made = path.with_name(f".{path.name}.new")
    try:
        group = zarr.open_group(str(made), mode="w", zarr_format=3)
        group.attrs.update(
            {
                "schema": SCHEMA,
                "version": version("kerrcaustics"),
                "title": scene.title,
                "engine": "auto",
                "tolerance": scene.tolerance,
                "scene": json.dumps(scene.record()),
                "description": "Caustics of Kerr black holes. The camera is at phi' = 0; phi' is unwrapped.",
            }
        )
        _create_arrays(group, scene)
        with warnings.catch_warnings():
            # Readers without this extension of the format read the arrays' own descriptions.
            warnings.simplefilter("ignore")
            zarr.consolidate_metadata(group.store)
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
    for variable in variables(scene):
        sizes = tuple(len(further[dim]) for dim in variable.dims)
        _create_array(group, scene, variable, sizes, math.nan if variable.dtype.startswith("float") else -1)
    _create_array(group, scene, _STATUS, (), 0)
    _create_array(group, scene, _REASONS, (_REASON,), 0)


def _create_array(group: zarr.Group, scene: Scene, about: Quantity, sizes: tuple[int, ...], blank: float) -> None:
    """An array of blanks over all points, in chunks of a block; sizes: of its further dimensions."""
    group.create_array(
        about.name,
        shape=scene.shape + sizes,
        chunks=(1, _block_size(scene), 1, *sizes),
        dtype=about.dtype,
        fill_value=blank,
        compressors=[ZstdCodec(level=3), Crc32cCodec()],
        dimension_names=(*AXES, *about.dims),
        attributes={"units": about.unit, "long_name": about.text},
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


def _blank(variable: Quantity, scene: Scene) -> Array:
    further = dimensions(scene)
    fill = math.nan if variable.dtype.startswith("float") else -1
    return np.full([len(further[dim]) for dim in variable.dims], fill, variable.dtype)


def _coded(text: str) -> UInt8[Array, "160"]:
    code = text.encode()[:_REASON]
    return np.frombuffer(code.ljust(_REASON, b"\0"), np.uint8)
