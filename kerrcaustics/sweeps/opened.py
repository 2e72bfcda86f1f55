"""Stores of sweeps that are read: how far one is, and its Dataset with the reasons of failed points as text."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kerrcaustics.extras import needed
from kerrcaustics.files import check_name, locked
from kerrcaustics.sweeps import descriptions
from kerrcaustics.sweeps.store import Store

if TYPE_CHECKING:
    from xarray import Dataset


@dataclass(frozen=True)
class SweepStatus:
    """How far a sweep is.

    Attributes
    ----------
    title : str
        Title of the sweep.
    points : int
        Points of the sweep.
    done : int
        Points that are stored.
    failed : int
        Points that failed.
    missing : int
        Points that are not computed yet.
    failures : tuple of str
        A line for each point that failed, with its place and the reason.
    running : bool
        True if a sweep is writing to the store now.
    """

    title: str
    points: int
    done: int
    failed: int
    missing: int
    failures: tuple[str, ...]
    running: bool


def sweep_status(path: str | Path) -> SweepStatus:
    """Return how far the sweep is whose store is at `path`; nothing is changed there.

    Raise ValueError if there is no store.
    """
    store = _store(path)
    try:
        counts, failures = store.counts(), tuple(store.failures())
    except Exception:
        raise ValueError(f"The store {path} is damaged: the same sweep, started again, mends it.") from None
    return SweepStatus(
        title=store.scene.title,
        points=sum(counts.values()),
        **counts,
        failures=failures,
        running=_is_locked(store.path),
    )


def open_sweep(path: str | Path) -> "Dataset":
    """The store of a sweep as a Dataset of xarray, with the reasons of failed points as text.

    Parameters
    ----------
    path : str or path
        The store.

    Returns
    -------
    xarray.Dataset
        What `xarray.open_zarr` returns, but for `reason`: a text for each point, empty unless it failed.

    Raises
    ------
    ValueError
        If there is no store.

    Examples
    --------
    >>> from kerrcaustics.sweeps.opened import open_sweep
    >>> open_sweep("sweep.zarr").reason  # doctest: +SKIP
    """
    store = _store(path)
    dataset = needed("sweep", "xarray").open_zarr(store.path)
    padded = np.ascontiguousarray(dataset.reason.values)
    rows = padded.reshape(-1, padded.shape[-1])
    texts = np.array([bytes(row).rstrip(b"\0").decode(errors="replace") for row in rows], object)
    attributes = {"long_name": "why a point failed, empty unless it did"}
    reason = (dataset.reason.dims[:-1], texts.reshape(padded.shape[:-1]), attributes)
    return dataset.drop_vars("reason").assign(reason=reason)


def _store(path: str | Path) -> Store:
    check_name(path)
    if not Path(path).exists():
        raise ValueError(f"Argument `path` must name the store of a sweep, but {path} does not exist.")
    if not descriptions.root(Path(path)).is_file():
        raise ValueError(f"Argument `path` must name the store of a sweep, but {path} is none.")
    return Store(Path(path))


def _is_locked(path: Path) -> bool:
    try:
        with locked(path, "in use"):
            return False
    except ValueError:
        return True
