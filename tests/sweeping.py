"""What the tests of sweeps share."""

import hashlib
import warnings
from pathlib import Path

import xarray

PLAIN = "spin = [0.5, 0.9]\nradius = [3.0, 4.0, 6.0]\norders = 1\nblock = 2\ncompute = ['areas']\ntitle = 'Schön'\n"


def written(folder, text, name="scene.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def files(store):
    """Every file of a store, by its content."""
    paths = sorted(path for path in Path(store).rglob("*") if path.is_file())
    return {str(path.relative_to(store)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def opened(path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return xarray.open_zarr(path)
