"""Arrays in a zip file (NumPy .npz), each read only if its size is the declared one.

A small file can unpack to more than any memory holds: nothing is unpacked before its length is checked.
"""

import math
import os
from typing import IO, Any
from zipfile import ZipFile

import numpy as np

Array = np.ndarray

# Numbers, truths and texts.
_KINDS = "biufcSU"
# Bytes that NumPy writes before the numbers of an array, at most.
_LARGEST_PREAMBLE = 1024
LARGEST_HEAD = 1 << 26
"""Bytes of a header, four for each of its characters."""


def read_head(archive: ZipFile) -> str:
    """Return the text in the member `head`; raise ValueError for one of more than `LARGEST_HEAD` bytes."""
    info = archive.getinfo("head.npy")
    if info.file_size > LARGEST_HEAD + _LARGEST_PREAMBLE:
        raise ValueError("the header is too long")
    with archive.open(info) as file:
        shape, dtype = _preamble(file)
        if shape != () or dtype.kind != "U":
            raise ValueError("the header is no text")
        return str(_numbers(file))


def stand_in(shape: Any, dtype: Any) -> Array:
    """Return an array that takes no memory: zeros of a shape and a type that a header names."""
    kind, lengths = np.dtype(str(dtype)), tuple(map(int, shape))
    if kind.kind not in _KINDS or any(length < 0 for length in lengths):
        raise ValueError("the header says no array")
    return np.broadcast_to(np.zeros((), kind), lengths)


def read_array(archive: ZipFile, name: str, template: Array) -> Array:
    """Return an array; raise ValueError unless its shape and type are those of `template`, before it is unpacked."""
    info = archive.getinfo(f"{name}.npy")
    with archive.open(info) as file:
        shape, dtype = _preamble(file)
        if (shape, dtype) != (template.shape, template.dtype):
            raise ValueError("an array is not what the header says")
        if info.file_size != file.tell() + _bytes(shape, dtype):
            raise ValueError("an array has another length than it says")
        return _numbers(file)


def check_room(arrays: list[Array]) -> None:
    """Raise ValueError for arrays that are larger together than the memory of this machine."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if sum(_bytes(array.shape, array.dtype) for array in arrays) > memory:
        raise ValueError("the arrays are larger than the memory")


def _bytes(shape: tuple[int, ...], dtype: np.dtype[Any]) -> int:
    return math.prod(shape) * dtype.itemsize


def _preamble(file: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of an array."""
    version = np.lib.format.read_magic(file)
    if version != (1, 0):
        raise ValueError("an array is of another format")
    shape, _, dtype = np.lib.format.read_array_header_1_0(file, max_header_size=_LARGEST_PREAMBLE)
    if dtype.kind not in _KINDS:
        raise ValueError("an array holds no numbers")
    return shape, dtype


def _numbers(file: IO[bytes]) -> Array:
    """The array, whose preamble has been read, and no byte more."""
    file.seek(0)
    array = np.lib.format.read_array(file, allow_pickle=False, max_header_size=_LARGEST_PREAMBLE)
    # The checksum is compared at the end.
    if file.read(1):
        raise ValueError("an array is longer than it says")
    return array
