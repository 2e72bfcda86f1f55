"""A process that goes on for long needs no more memory than one that has seen a few cameras."""

import functools
import gc

import numpy as np
import pytest
from conftest import give_back, resident

import kerrcaustics as kc


def entries():
    """The entries of each cache of the package, by its name; and those of caches without a limit."""
    kept = [o for o in gc.get_objects() if isinstance(o, functools._lru_cache_wrapper)]
    ours = [o for o in kept if o.__module__.startswith("kerrcaustics.")]
    held = {f"{o.__module__}.{o.__qualname__}": o.cache_info() for o in ours}
    return held, {name: info.currsize for name, info in held.items() if info.maxsize is None}


def seen_by(cameras):
    """Look at the sky from cameras, and return what memory (GB) and the caches hold then."""
    for camera in cameras:
        kc.caustics(camera, orders=1)
        kc.star_images(camera, (1.2, 0.7), 0)
    give_back()
    return resident(), *entries()


@pytest.mark.slow
def test_three_hundred_cameras_need_no_more_than_one_hundred():
    rng = np.random.default_rng(37)
    cameras = [kc.Camera(a, r) for a, r in rng.uniform([0.1, 6.0], [0.99, 40.0], (300, 2))]
    first, held, without_limit = seen_by(cameras[:100])
    last, still_held, still_without = seen_by(cameras[100:])
    assert last - first < 0.06, f"{first:.3f} GB, then {last:.3f} GB"
    assert still_without == without_limit
    found = "kerrcaustics.curves.critical_curves.found_curves"
    assert held[found].currsize == still_held[found].currsize == held[found].maxsize
