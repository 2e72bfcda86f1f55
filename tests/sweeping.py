"""Helpers of the tests of sweeps."""

import hashlib
import os
import signal
import time
import warnings
from pathlib import Path

import numpy as np
import xarray

import kerrcaustics as kc
from kerrcaustics.sweeps import run as engine
from kerrcaustics.sweeps.quantities import dimensions, variables

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


def made_up(scene, spin, radius, _inclination):
    """Numbers that cost nothing, in place of the physics."""
    if radius < 1:
        raise ValueError("too close")
    sizes = {name: len(values) for name, values in dimensions(scene).items()}
    seed = np.random.default_rng([int(1e6 * spin), int(1e6 * radius)])
    return {v.name: seed.integers(0, 99, [sizes[dim] for dim in v.dims]).astype(v.dtype) for v in variables(scene)}


def slowly_made_up(scene, spin, radius, inclination):
    """The same, in as much time as the physics takes; at radius 13 the process is killed."""
    time.sleep(0.2)
    if radius == 13:
        os.kill(os.getpid(), signal.SIGKILL)
    return made_up(scene, spin, radius, inclination)


def sweep_in_step(scene, folder, count, gate, answers):
    """Begin a store after the other at the same moments as other processes, and return how each ends."""
    engine.computed = made_up
    for i in range(count):
        gate.wait()
        try:
            kc.sweep(kc.read_scene(scene), folder / f"{i}.zarr")
            answers.put((i, "done"))
        except Exception as error:
            answers.put((i, "in use" if "another sweep is writing to it" in str(error) else repr(error)))
