"""Results kept between calls belong to a place: another velocity, or another emitter, finds all of them there."""

import math
import sys

import pytest

import kerrcaustics as kc

# No other test has a camera here.
SPIN, RADIUS = 0.51237, 10.0321
STAR, SPOT = (1.0, 2.0), (8.0, 2.0)
# Of lines a search takes several sets.
LINES = "kerrcaustics.lens_map.sky_lines._cached_edge"


def camera(velocity, inclination=math.pi / 2):
    return kc.Camera(SPIN, RADIUS, inclination, velocity)


def in_plane(velocity, emitter):
    return kc.star_images(camera(velocity, 1.0), SPOT, max_index=1, end=kc.EquatorialPlane(1, emitter))


ON_SKY = [lambda v=v: kc.star_images(camera(v), STAR, max_index=0) for v in ("circular", "static", (0.1, -0.2, 0.3))]
IN_PLANE = [lambda c=c: in_plane(*c) for c in (("static", "circular"), ("static", "static"), ("fiducial", "circular"))]


def misses():
    """The number of misses of each cache of the rooms of the lens map, curves, images and tracks."""
    rooms = tuple(f"kerrcaustics.{room}" for room in ("lens_map", "curves", "images", "tracks"))
    modules = [module for name, module in sys.modules.items() if name.startswith(rooms)]
    caches = {
        f"{f.__module__}.{f.__name__}": f
        for module in modules
        for f in vars(module).values()
        if hasattr(f, "cache_info")
    }
    return {name: cached.cache_info().misses for name, cached in caches.items()}


@pytest.mark.parametrize(
    ("first", "others", "kept"),
    [
        pytest.param(ON_SKY[0], ON_SKY[1:], 3, id="sky"),
        pytest.param(IN_PLANE[0], IN_PLANE[1:], 2, id="plane", marks=pytest.mark.slow),
    ],
)
def test_velocities_and_emitters_make_one_miss(first, others, kept):
    before = misses()
    images = first()
    after = misses()
    new = [count - before.get(name, 0) for name, count in after.items() if name != LINES]
    assert sorted(new)[-kept:] == [1] * kept and sum(new) == kept
    for other in others:
        # The answer is another one all the same.
        assert not math.isclose(other().redshift[0], images.redshift[0], rel_tol=1e-6)
        assert misses() == after
