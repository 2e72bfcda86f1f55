"""Searches by kernels find what searches step by step find."""

import math

import numpy as np
import pytest
from marks import few

import kerrcaustics as kc
from kerrcaustics.beams.ends import SKY, Sphere
from kerrcaustics.images.sheets import WIDE, sheets_of
from kerrcaustics.lens_map.newton import find_roots, step_by_step
from kerrcaustics.spacetime.sphere import from_angles

STARS = 60
MOST_STEPS = 80
CASES = {
    "off the equator": (kc.Camera(0.9, 10.0, 1.2), SKY),
    "on the equator": (kc.Camera(0.999, 6.03), SKY),
    "close": (kc.Camera(0.5, 2.5, 0.7), SKY),
    "without spin": (kc.Camera(0.0, 10.0, 1.0), SKY),
    "next to an extremal hole": (kc.Camera(1 - 1e-9, 1.5, 1.4), SKY),
    "on the axis": (kc.Camera(0.9, 10.0, 0.0), SKY),
    "an observer": (kc.Observer(spin=0.9, inclination=1.0), SKY),
    "far away": (kc.Camera(0.9, 1e6, 1.0), SKY),
    "a sphere": (kc.Camera(0.9, 10.0, 1.2), Sphere(30.0)),
    "a sphere seen from the equator": (kc.Camera(0.6, 8.0), Sphere(12.0)),
}


@pytest.fixture
def random():
    return np.random.default_rng(4)


@pytest.mark.parametrize("name", few(CASES, sorted(CASES.keys() - {"next to an extremal hole"})))
def test_kernels_find_the_roots_that_are_found_step_by_step(name, random):
    camera, end = CASES[name]
    sheets = sheets_of(camera, 2, end)
    star = from_angles(np.arccos(random.uniform(-1, 1, STARS)), random.uniform(-math.pi, math.pi, STARS))
    owner, index, sky = sheets.starts(star, WIDE)
    found = find_roots(sheets.camera, star[owner], index, sky, end=sheets.surface)
    known = step_by_step(sheets.camera, star[owner], index, sky, MOST_STEPS, sheets.surface, charted=True)
    which, ours, theirs = np.intersect1d(found[0], known[0], return_indices=True)
    # A search from afar may come to rest where another one goes on.
    assert len(which) > 0.98 * max(len(found[0]), len(known[0])) > STARS
    away = np.linalg.norm(found[1][ours] - known[1][theirs], axis=1)
    assert (away < found[2][ours] + known[2][theirs]).all()


def test_searches_on_a_sphere_within_the_cameras_radius_go_straight(random):
    camera, end = kc.Camera(0.9, 20.0, 1.2, "fiducial"), Sphere(8.0)
    sky = camera.directions(random.normal(size=(2000, 3)))
    sky /= np.linalg.norm(sky, axis=1)[:, None]
    beams = kc.trace_beams(camera, sky, end=end)
    sky, seen = sky[beams.escaped], beams.direction[beams.escaped]
    index = beams.index[beams.escaped]
    star = seen + 1e-3 * random.normal(size=seen.shape)
    star /= np.linalg.norm(star, axis=1)[:, None]
    found = find_roots(camera, star, index, sky, end=end)
    known = step_by_step(camera, star, index, sky, MOST_STEPS, end, charted=False)
    np.testing.assert_array_equal(found[0], known[0])
    assert len(found[0]) > 20
    away = np.linalg.norm(found[1] - known[1], axis=1)
    assert (away < found[2] + known[2]).all()
