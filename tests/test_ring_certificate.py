"""The certificate of photon rings over many viewers, and that rays beside an edge end on the side that it says."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.lens_map.plane_edges import CrossingCircles, interpolated, lines_on, plane_edges
from kerrcaustics.lens_map.search_sky import search_camera
from kerrcaustics.rings import bands
from kerrcaustics.rings.certificate import met_once
from kerrcaustics.spacetime import kerr

SPINS = [0.0, 1e-4, 0.1, 0.5, 0.9, 0.99, 0.999]
# Viewers of the slow test, and of the fast one; directions beside each edge.
MANY, FEW = 300, 12
DIRECTIONS = 10_000


def viewer(number):
    """A viewer off the plane and outside the ergosphere: at infinity, far, near, among the photon orbits."""
    random = np.random.default_rng([number, 12])
    spin = float(random.choice(SPINS))
    inclination = float(random.choice([random.uniform(0.02, 1.5), random.uniform(1.64, 3.12), 0.0, 1.56]))
    kind = number % 4
    if kind == 0:
        return kc.Observer(spin=spin, inclination=inclination)
    if kind == 1:
        return kc.Observer(spin=spin, inclination=inclination, radius=float(10 ** random.uniform(1.5, 6)))
    near = 2.05 + (10 ** random.uniform(-1, 1.2) if kind == 2 else random.uniform(0, 2))
    return kc.Camera(spin, float(near), inclination, "fiducial")


def wrong_directions(one, count):
    """Directions at 1e-9 to 1e-2 of the distance from each edge that end on the wrong side, farther than its error."""
    camera, random = search_camera(one), np.random.default_rng(5)
    far = isinstance(camera, kc.Observer)
    names = [
        (n, side) for n in (0, 1, 2) for side in (kerr.horizon(one.spin), math.inf) if n or side < math.inf or not far
    ]
    circles = CrossingCircles(np.array([n + 1 for n, _ in names]), np.array([side for _, side in names]))
    edges = plane_edges(camera, circles)
    lines = lines_on(camera, count)
    chi = 2 * np.pi * (np.arange(count) + 0.5) / count
    curve = interpolated(edges.distance, chi)
    offset = random.choice([-1, 1], curve.shape) * 10 ** random.uniform(-9, -2, curve.shape)
    distance = np.clip(curve * (1 + offset), 0.999999 * lines.first[:, None], 0.999999 * lines.last[:, None])
    wrong = 0
    for column, (order, side) in enumerate(names):
        sky = lines.sky(distance[:, column])
        rays = kc.trace_rays(camera, camera.places(sky), end=kc.EquatorialPlane(order + 1))
        crosses = np.isfinite(rays.radius)
        beyond = (
            ~crosses & (rays.status != kc.Status.CAPTURED)
            if side == math.inf
            else crosses | (rays.status != kc.Status.CAPTURED)
        )
        outside = distance[:, column] > curve[:, column]
        known = rays.status != kc.Status.INACCURATE
        apart = np.abs(distance - curve)[:, column] > edges.error[:, column].max()
        wrong += int(((beyond != outside) & known & apart).sum())
    return wrong, bool(met_once(camera, circles).all())


@pytest.mark.parametrize("number", range(FEW))
def test_rays_beside_edges_end_on_their_sides(number):
    wrong, once = wrong_directions(viewer(number), 300)
    assert wrong == 0 and once


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, MANY, 20))
def test_rays_of_many_viewers_end_on_their_sides(first):
    found = {number: wrong_directions(viewer(number), DIRECTIONS) for number in range(first, first + 20)}
    assert {number: one for number, one in found.items() if one != (0, True)} == {}


@pytest.mark.parametrize("number", range(4))
def test_bands_of_such_viewers_are_certified(number):
    rings = kc.photon_rings(viewer(number), max_order=2)
    assert rings.certified, rings.remarks


def test_an_edge_that_is_off_is_not_certified(monkeypatch):
    """By a part of a million: rays beside it end on the wrong side, and half as many lines do not agree."""
    right = bands.plane_edges

    def off(camera, circles):
        edges = right(camera, circles)
        return edges._replace(distance=edges.distance * (1 + 1e-4))

    monkeypatch.setattr(bands, "plane_edges", off)
    rings = kc.photon_rings(viewer(0), max_order=1)
    assert not rings.certified and "end on the wrong side" in rings.remarks[0]


def test_edges_with_too_few_nodes_are_not_certified_or_say_their_error(monkeypatch):
    viewer_beside = kc.Observer(spin=0.999, inclination=math.radians(85))
    fine = kc.photon_rings(viewer_beside, max_order=1)[1]
    monkeypatch.setattr(bands, "plane_edges", lambda camera, circles: plane_edges(camera, circles, 64))
    coarse = kc.photon_rings(viewer_beside, max_order=1)[1]
    assert abs(coarse.solid_angle - fine.solid_angle) < coarse.solid_angle_error
    assert coarse.solid_angle_error > 1e4 * fine.solid_angle_error


def test_lines_that_meet_an_edge_again_are_noticed():
    """Among the photon orbits of a fast hole, in its ergosphere, the image of the horizon is met more than once."""
    uncertified = 0
    for radius in (1.2, 1.5):
        for inclination in (0.9, 1.5):
            rings = kc.photon_rings(kc.Camera(0.999, radius, inclination, "fiducial"), max_order=0)
            assert rings.certified or rings.remarks
            uncertified += not rings.certified
    assert uncertified > 0
