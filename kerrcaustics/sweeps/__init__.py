"""Sweeps over spin, radius and inclination, kept in one store that survives interruptions."""

from importlib.util import find_spec

if find_spec("zarr") is None:
    raise ImportError('Sweeps need the package zarr: pip install "kerrcaustics[sweep]"', name="zarr")
