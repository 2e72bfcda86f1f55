"""The store of a sweep: one zarr store (version 3), a chunk for a block of points, and a mask of finished ones.

A block's chunks are written one after the other, each in one go, the mask last: a block is done if the mask marks it,
all its chunks can be read, and the digests of its points are theirs. Every chunk carries a checksum; a digest tells
a chunk of another place or another scene. The other files follow from the scene, and are mended when a store is opened
(descriptions.py). The numbers of a point depend on the point alone, so that a store ends up the same to the bit
wherever and however often the sweep was interrupted.
"""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from kerrcaustics.files import locked, make_room
from kerrcaustics.results.declared import Quantity
from kerrcaustics.sweeps import descriptions
from kerrcaustics.sweeps.descriptions import DIGEST, REASON, blank_of, block_size, mark_of
from kerrcaustics.sweeps.quantities import dimensions, variables
from kerrcaustics.sweeps.scene import AXES, Scene

Array = np.ndarray

WAITING = 0
"""Status of a point that is not computed yet."""
DONE = 1
"""Status of a point that is stored."""
FAILED = 2
"""Status of a point whose computation failed."""
KEPT = "kept"
"""State of a block that is stored and intact."""
OPEN = "open"
"""State of a block that is to be computed."""
DAMAGED = "damaged"
"""State of a block that cannot be read, or is another's."""


@dataclass(frozen=True)
class Block:
    """Points that are computed and stored together: one spin, some radii, one inclination, by number."""

    spin: int
    radii: tuple[int, int]
    inclination: int

    @property
    def region(self) -> tuple[slice, slice, slice]:
        """Slices of the arrays that hold the points."""
        i, k = self.spin, self.inclination
        return slice(i, i + 1), slice(*self.radii), slice(k, k + 1)

    def __len__(self) -> int:
        """Number of points."""
        return self.radii[1] - self.radii[0]


class Store:
    """A store that is open for a scene."""

    def __init__(self, path: Path, mended: tuple[str, ...] = ()) -> None:
        """Open a store whose descriptions are intact; mended: the names of those that were not."""
        self.path, self.mended = path, mended
        try:
            self._group = zarr.open_group(str(path), mode="r+")
            attributes: dict[str, Any] = dict(self._group.attrs)
        except Exception:
            raise descriptions.no_store(path) from None
        self.scene = descriptions.scene_in(path, attributes)
        self._variables = variables(self.scene)

    def blocks(self) -> list[Block]:
        """All blocks, in order."""
        spins, radii, inclinations = self.scene.shape
        size = block_size(self.scene)
        return [
            Block(i, (j, min(j + size, radii)), k)
            for i in range(spins)
            for k in range(inclinations)
            for j in range(0, radii, size)
        ]

    def clean(self) -> None:
        """Remove the unfinished chunks and descriptions of processes that were killed."""
        for part in self.path.rglob("*.part*"):
            if part.suffix in (".part", ".partial") and part.is_file():
                part.unlink(missing_ok=True)

    def state(self, block: Block, retry: bool = False) -> str:
        """KEPT if the mask marks the block as done, and every chunk of it can be read and belongs to it.

        Else OPEN, also if a point failed that is to be tried again; DAMAGED if a chunk cannot be read, or is another's.
        """
        try:
            if not self._chunk("status", block).is_file():
                return OPEN
            status = self._read("status", block)
            if (status == WAITING).any() or (retry and (status == FAILED).any()):
                return OPEN
            names = (*(variable.name for variable in self._variables), "reason")
            values = {"status": status, **{name: self._read(name, block) for name in names}}
            if not np.array_equal(self._read(DIGEST.name, block), self._digests(block, values)):
                return DAMAGED
        except Exception:
            # For any damage of a chunk, its block is computed again.
            return DAMAGED
        return KEPT

    def write(self, block: Block, points: list[dict[str, Array] | str]) -> None:
        """Store the points of a block: values, or the reason if there are none. The mask is written last."""
        shape = [part.stop - part.start for part in block.region]
        status = np.array([FAILED if isinstance(point, str) else DONE for point in points], np.int8).reshape(shape)
        values = {}
        for variable in self._variables:
            each = [_blank(variable, self.scene) if isinstance(p, str) else p[variable.name] for p in points]
            stacked = np.stack([np.asarray(v, variable.dtype) for v in each])
            values[variable.name] = stacked.reshape(*shape, *stacked.shape[1:])
        reasons = np.array([p.encode()[:REASON] if isinstance(p, str) else b"" for p in points], f"S{REASON}")
        values["reason"] = reasons.view(np.uint8).reshape(*shape, REASON)
        digests = self._digests(block, {"status": status, **values})
        for name, array in {**values, DIGEST.name: digests, "status": status}.items():
            self._write(name, block, array)

    def counts(self) -> dict[str, int]:
        """Numbers of points that are done, that failed, and that are not computed yet."""
        status = np.asarray(self._array("status")[...])
        states = {"done": DONE, "failed": FAILED, "missing": WAITING}
        return {name: int((status == state).sum()) for name, state in states.items()}

    def failures(self) -> list[str]:
        """A line for every point that failed: its place, and the reason."""
        _check_in_place(self.path)
        status, reason = self._array("status")[...], self._array("reason")[...]
        values = [self.scene.values(axis) for axis in AXES]
        lines = []
        for place in np.argwhere(np.asarray(status) == FAILED):
            spin, radius, inclination = (axis[i] for axis, i in zip(values, place, strict=True))
            text = bytes(np.asarray(reason)[tuple(place)]).rstrip(b"\0").decode(errors="replace")
            lines.append(f"spin {spin:.12g}, radius {radius:.12g}, inclination {inclination:.12g}: {text}")
        return lines

    def _digests(self, block: Block, values: dict[str, Array]) -> Array:
        """A hash of the scene, the place and all values of each point of a block."""
        mark, first = mark_of(self.scene), [part.start for part in block.region]
        plain = [
            np.ascontiguousarray(values[name]).astype(values[name].dtype.newbyteorder("<")) for name in sorted(values)
        ]
        digests = np.zeros(values["status"].shape, DIGEST.dtype)
        for place in np.ndindex(*digests.shape):
            hashed = hashlib.sha256(f"{mark} {np.add(first, place).tolist()}".encode())
            for array in plain:
                hashed.update(array[place].tobytes())
            digests[place] = int.from_bytes(hashed.digest()[:8], "little")
        return digests

    def _array(self, name: str) -> Any:
        # Blank chunks are written too, so that a missing chunk is a lost one.
        return self._group[name].with_config({"write_empty_chunks": True})  # pyright: ignore

    def _write(self, name: str, block: Block, values: Array) -> None:
        _check_in_place(self.path)
        chunk = self._chunk(name, block)
        try:
            make_room(chunk)
            self._array(name)[block.region] = values
        finally:
            if not descriptions.root(self.path).is_file():
                _withdraw(chunk, self.path)
                raise descriptions.moved(self.path)

    def _read(self, name: str, block: Block) -> Array:
        # A missing chunk would be read as blanks.
        if not self._chunk(name, block).is_file():
            raise FileNotFoundError(name)
        return np.asarray(self._array(name)[block.region])

    def _chunk(self, name: str, block: Block) -> Path:
        """The file of a chunk."""
        array = self._array(name)
        place = [part.start // size for part, size in zip(block.region, array.chunks, strict=False)]
        place += [0] * (array.ndim - len(place))
        return self.path / name / array.metadata.encode_chunk_key(tuple(place))


@contextmanager
def store_at(path: Path, scene: Scene) -> Iterator[Store]:
    """The store of a scene at `path`, made when missing and mended when damaged, while no other sweep writes to it.

    Raise ValueError if the path holds something else, and if another sweep has the store.
    """
    if not path.exists():
        if not path.absolute().parent.is_dir():
            raise ValueError(f"Argument `path` must lie in a folder that exists, but {str(path.parent)!r} is none.")
        descriptions.create(path, scene)
    elif not path.is_dir():
        raise descriptions.no_store(path)
    with locked(path, f"The store {path} is in use: another sweep is writing to it."):
        descriptions.remove_unfinished_stores(path)
        mended = descriptions.mend(path, descriptions.scene_of(path, scene))
        store = Store(path, mended)
        store.clean()
        yield store


def opened_again(path: Path) -> Store:
    """The store of a sweep that is running, for a worker; a ValueError if it is no longer there."""
    _check_in_place(path)
    try:
        return Store(path)
    except ValueError:
        # It may have gone in between.
        _check_in_place(path)
        raise


def _check_in_place(path: Path) -> None:
    if not descriptions.root(path).is_file():
        raise descriptions.moved(path)


def _withdraw(chunk: Path, path: Path) -> None:
    """Remove a chunk that was written where a store has been, and its folders if they are empty."""
    chunk.unlink(missing_ok=True)
    with suppress(OSError):
        for folder in chunk.parents[: len(chunk.relative_to(path).parts)]:
            folder.rmdir()


def _blank(variable: Quantity, scene: Scene) -> Array:
    coordinates = dimensions(scene)
    return np.full([len(coordinates[dim]) for dim in variable.dims], blank_of(variable.dtype), variable.dtype)
