"""Images of circles in the plane by Mino times: against exact values, and against rays that are traced."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.lens_map.plane_edges import (
    CrossingCircles,
    chi_of,
    crossing_gap,
    distances,
    edge_phase_of,
    interpolated,
    lines_on,
    plane_edges,
)
from kerrcaustics.lens_map.search_sky import search_camera
from kerrcaustics.numerics import fourier
from kerrcaustics.spacetime import kerr

# Spin 0, face on, from infinity: impact parameters of the horizon and of infinity at crossings 1, 2, ..., by quadrature
# of the swept angle in 30 digits.
FACE_ON = [
    (2.8476963313950621, None),
    (5.0151354941983346, 6.1675667647680063),
    (5.1878081748760748, 5.2279386085338372),
    (5.1957902930053547, 5.1975054870627264),
]
VIEWERS = {
    "infinity": kc.Observer(spin=0.94, inclination=0.3),
    "south": kc.Observer(spin=0.5, inclination=2.2, radius=1000.0),
    "camera": kc.Camera(0.9, 6.0, 1.0, "fiducial"),
    "photon orbits": kc.Camera(0.99, 1.9, 0.8, "fiducial"),
    "no spin": kc.Camera(0.0, 2.6, 1.2, "fiducial"),
}


@pytest.fixture
def random():
    return np.random.default_rng(7)


def test_impact_parameters_without_spin_and_face_on_are_exact():
    camera = kc.Observer(spin=0.0, inclination=0.0)
    ends = [(n, b, kind) for n, row in enumerate(FACE_ON) for b, kind in zip(row, (2.0, math.inf), strict=True) if b]
    circles = CrossingCircles(np.array([n + 1 for n, _, _ in ends]), np.array([kind for _, _, kind in ends]))
    lines = lines_on(camera, 16)
    for (_, impact, _), distance in zip(ends, distances(camera, lines, circles).T, strict=True):
        size = np.hypot(*camera.places(lines.sky(distance)).T)
        np.testing.assert_allclose(size, impact, rtol=1e-13)


@pytest.mark.parametrize("name", VIEWERS)
def test_gaps_have_the_sign_that_rays_have(name, random):
    """Circles within the viewer's radius and beyond, at places close to the shadow edge and anywhere on lines."""
    camera = search_camera(VIEWERS[name])
    horizon = kerr.horizon(camera.spin)
    lines = lines_on(camera, 60)
    parts = random.choice([-1, 1], (60, 40)) * 10 ** random.uniform(-8, 0, (60, 40))
    reach = np.where(parts < 0, -lines.first[:, None], lines.last[:, None])
    sky = lines.sky(0.999 * parts * reach)
    for crossing in (1, 2, 3):
        rays = kc.trace_rays(camera, camera.places(sky), end=kc.EquatorialPlane(crossing))
        crosses = np.isfinite(rays.radius)
        for radius in (
            horizon,
            1.1 * horizon,
            0.9 * min(camera.radius, 50.0),
            3.5,
            1.3 * min(camera.radius, 50.0),
            math.inf,
        ):
            within = np.where(crosses, rays.radius < radius, rays.status == kc.Status.CAPTURED)
            gap = crossing_gap(camera, sky, np.array(crossing), np.array(radius))
            known = ~crosses | (np.abs(rays.radius / radius - 1) > 1e-8)
            assert ((gap > 0) == within)[known].all(), (crossing, radius)


@pytest.mark.parametrize("inclination", [0.0, 1.0, 1.57, math.pi / 2, 3.0])
def test_chi_is_the_inverse_of_the_edge_phase(inclination):
    camera = kc.Observer(spin=0.5, inclination=inclination)
    chi = np.linspace(-7.0, 7.0, 301)
    np.testing.assert_allclose(
        edge_phase_of(camera, chi_of(camera, edge_phase_of(camera, chi))), edge_phase_of(camera, chi), atol=1e-14
    )
    # In the plane the phase goes as the cube of chi.
    assert chi_of(camera, np.array(0.0)) == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("name", ["infinity", "south", "camera", "photon orbits"])
def test_curves_between_lines_are_good_to_their_errors(name, random):
    camera = search_camera(VIEWERS[name])
    circles = CrossingCircles(
        np.array([1, 2, 3, 2, 3, 1]), np.array([kerr.horizon(camera.spin)] * 3 + [math.inf] * 2 + [5.0])
    )
    edges = plane_edges(camera, circles)
    assert edges.agrees.all()
    finer = distances(camera, lines_on(camera, 62), circles)
    off = np.abs(interpolated(edges.distance, fourier.nodes(62)) - finer)
    assert (off <= edges.error.max(axis=0)).all()
    assert edges.error.max() < 1e-9


def test_errors_are_honest_where_nodes_are_too_few():
    camera = kc.Observer(spin=0.999, inclination=math.radians(85))
    circles = CrossingCircles(np.array([1, 2, 2]), np.array([kerr.horizon(0.999)] * 2 + [math.inf]))
    edges = plane_edges(camera, circles, most_nodes=64)
    finer = distances(camera, lines_on(camera, 150), circles)
    off = np.abs(interpolated(edges.distance, fourier.nodes(150)) - finer).max(axis=0)
    assert (off > 1e-6).all() and (off < edges.error.max(axis=0)).all()


def test_a_circle_that_is_seen_on_both_sides_of_the_shadow_edge_is_found():
    camera = kc.Observer(spin=0.9, inclination=1.2)
    circles = CrossingCircles(np.array([1]), np.array([4.0]))
    edges = plane_edges(camera, circles)
    assert edges.distance.min() < 0 < edges.distance.max()
    lines = lines_on(camera, len(edges.distance))
    rays = kc.trace_rays(camera, camera.places(lines.sky(edges.distance[:, 0])), end=kc.EquatorialPlane(1))
    np.testing.assert_allclose(rays.radius, 4.0, rtol=1e-10)
