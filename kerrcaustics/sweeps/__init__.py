"""Sweeps over spin, radius and inclination, kept in one store that survives interruptions."""

from importlib.util import find_spec

for _name in ("msgspec", "zarr"):
    if find_spec(_name) is None:
        raise ImportError(f'Sweeps need the package {_name}: pip install "kerrcaustics[sweep]"', name=_name)
