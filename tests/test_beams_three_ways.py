"""The package's beams against the beam equation in two other forms: three ways that share no code."""

import math

import numpy as np
import pytest
from beam_equations import Event, pineault_roeder_beam, walker_penrose_beam

from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.shadow import shadow_edge

# Spin, radius, inclination and FIDO velocity: on and off the equator, motion in each direction and in all.
EVENTS = [
    Event(0.0, 5.0, math.pi / 2),
    Event(0.0, 7.0, 0.7, (0.3, 0.1, -0.2)),
    Event(0.5, 3.0, math.pi / 2, (0.5, 0.0, 0.0)),
    Event(0.5, 12.0, 2.5, (0.0, -0.6, 0.0)),
    Event(0.999, 6.03, math.pi / 2, (0.0, 0.0, 0.40819565)),
    Event(0.999, 2.6, math.pi / 2, (0.0, 0.0, -0.48)),
    Event(0.999, 1.4, 1.2, (-0.3, 0.2, 0.4)),
    Event(0.999, 30.0, 0.3, (-0.2, 0.5, 0.3)),
]
EDGE_EVENTS = [EVENTS[4], Event(0.5, 8.0, 1.1, (0.1, 0.2, 0.3))]
POLE_EVENTS = [
    Event(0.0, 6.0, 1.0),
    Event(0.5, 10.0, 1.3),
    Event(0.999, 6.03, math.pi / 2),
    Event(0.999, 4.0, 0.2),
]


def generic_rays(event: Event, count: int, rng: np.random.Generator) -> list[tuple[Event, np.ndarray]]:
    """The first `count` random directions that escape."""
    sky = rng.normal(size=(20 * count, 3))
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    escaped = trace_beams(Camera(*event), sky).escaped
    return [(event, n) for n in sky[escaped][:count]]


def edge_rays(event: Event) -> list[tuple[Event, np.ndarray]]:
    """Rays 0.1 to 0.001 rad outside the shadow: at its prograde and retrograde ends, and between."""
    edge = shadow_edge(Camera(*event), n=4)
    centre = edge.mean(axis=0)
    rays = []
    for point, distance in zip(edge[[0, 1, 2, 3, 0, 2]], (1e-2, 1e-2, 1e-2, 1e-1, 1e-3, 1e-3), strict=True):
        away = point * (point @ centre) - centre
        rays.append((event, math.cos(distance) * point + math.sin(distance) * away / np.linalg.norm(away)))
    return rays


def pole_rays(event: Event) -> list[tuple[Event, np.ndarray]]:
    """Rays over the poles: with b = 0 exactly, and with a small b."""
    height = 1.4 * math.asin(min(6 / event.radius, 0.75))
    inward, up = -math.cos(height), math.sin(height)
    return [(event, np.array([inward, side, sign * up])) for side, sign in ((0.0, 1), (0.0, -1), (3e-3, 1))]


def compared(rays: list[tuple[Event, np.ndarray]]) -> dict[str, np.ndarray]:
    """Diameters of each ray in the three ways, one row a ray."""
    rays = [(event, n / np.linalg.norm(n)) for event, n in rays]
    beams = [trace_beams(Camera(*event), n, tolerance=1e-13) for event, n in rays]
    short = [walker_penrose_beam(*ray) for ray in rays]
    long = [pineault_roeder_beam(*ray) for ray in rays]
    return {
        "engine": np.array([(beam.delta_plus, beam.delta_minus) for beam in beams]),
        "short": np.array([(beam.delta_plus, beam.delta_minus) for beam in short]),
        "long": np.array([(beam.delta_plus, beam.delta_minus) for beam in long]),
        "index": np.array([(beam.index, other.index) for beam, other in zip(beams, short, strict=True)]),
        "angle": np.array([(beam.position_angle, other.orientation) for beam, other in zip(beams, long, strict=True)]),
    }


@pytest.fixture(scope="module")
def forty():
    rng = np.random.default_rng(20150213)
    rays = [ray for event in EVENTS for ray in generic_rays(event, 2, rng)]
    rays += [ray for event in EDGE_EVENTS for ray in edge_rays(event)]
    return compared(rays + [ray for event in POLE_EVENTS for ray in pole_rays(event)])


@pytest.fixture(scope="module")
def many():
    rng = np.random.default_rng(32)
    return compared([ray for event in EVENTS + EDGE_EVENTS for ray in generic_rays(event, 20, rng)])


def assert_agreement(results: dict[str, np.ndarray]) -> None:
    engine = results["engine"]
    assert np.isfinite(engine).all()
    # Measured: 3e-12 at most.
    for other in ("short", "long"):
        assert np.max(np.abs(results[other] - engine) / engine[:, :1]) < 1e-10
    assert np.array_equal(results["index"][:, 0], results["index"][:, 1])
    # An error of 1e-9 delta_plus turns the major axis by this much, the more the rounder the ellipse is.
    turn = 1e-9 * engine[:, 0] / (engine[:, 0] - np.abs(engine[:, 1]))
    angle = results["angle"]
    assert np.all(np.abs((angle[:, 0] - angle[:, 1] + math.pi / 2) % math.pi - math.pi / 2) < turn)


@pytest.mark.slow
def test_forty_rays_in_three_ways(forty):
    assert len(forty["engine"]) == 40
    assert_agreement(forty)


@pytest.mark.slow
def test_the_forty_rays_are_varied(forty):
    engine = forty["engine"]
    assert engine[:, 0].max() > 300
    assert (engine[:, 1] > 0).any() and (engine[:, 1] < 0).any()
    assert set(forty["index"][:, 0]) >= {0, 1, 2}


@pytest.mark.slow
def test_many_rays_in_three_ways(many):
    assert_agreement(many)
