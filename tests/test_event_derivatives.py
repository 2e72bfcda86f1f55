"""Derivatives of pair events: against other viewers and paths, and where they follow from a symmetry."""

import math

import numpy as np
import parity
import pytest

import kerrcaustics as kc

# Steps of the differences, relative to the numbers: an error of their fourth power is left, and rounding over them.
WIDE = 1e-3
NOISE = 1e-8
CELLS = [
    ("near", "sky", 2),
    ("near", "within", 1),
    ("near", "plane", 2),
    ("far", "sky", 2),
    ("finite", "sky", 2),
    ("infinity", "sky", 2),
    ("infinity", "within", 1),
    ("infinity", "plane", 2),
]


def level_of(viewer, order, end):
    """A circle that crosses the caustic of an order, away from its ends."""
    first = next(curve.place[:, 0] for curve in kc.caustics(viewer, order, end=end) if curve.order == order)
    return float(first.min() + 0.6 * (first.max() - first.min())) if np.ptp(first) < 2 else 8.0


def events_of(viewer, level, order, end):
    """Azimuth and time of the events of an order."""
    found = [event for event in kc.pair_events(viewer, level, order, end=end) if event.order == order]
    return np.array([(event.azimuth, event.time) for event in found])


def numbers_of(viewer, level):
    place = (viewer.spin, viewer.radius, viewer.inclination, level)
    return np.array([value for value in place if math.isfinite(value)])


def displaced(viewer, numbers):
    place = {"spin": numbers[0], "inclination": numbers[-2], "radius": numbers[1] if len(numbers) == 4 else math.inf}
    motion = {"velocity": viewer.velocity} if isinstance(viewer, kc.Camera) else {}
    return type(viewer)(**place, **motion), float(numbers[-1])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "surface", "order"), CELLS, ids=str)
def test_derivatives_against_other_viewers_and_paths(name, surface, order):
    viewer, end = parity.viewer_named(name), parity.end_for(surface, name)
    level = level_of(viewer, order, end)
    events = kc.pair_events(viewer, level, order, end=end)
    chosen = [i for i, event in enumerate(events) if event.order == order]
    found = kc.event_derivatives(viewer, events)
    numbers = numbers_of(viewer, level)
    assert chosen and found.azimuth.shape == found.time.shape == (len(events), len(numbers))
    mine = np.stack([found.azimuth, found.time], axis=1)[chosen]
    error = found.error[chosen] * np.abs(mine).max(axis=2)
    assert found.error[chosen].max() < (1e-5 if name == "far" else 1e-7)
    whole = events_of(viewer, level, order, end)
    for k, number in enumerate(numbers):
        change = np.zeros(len(numbers))
        change[k] = WIDE * number if surface == "plane" or k < len(numbers) - 1 else 1e-4
        slopes = []
        for part in (1.0, 0.5):
            after, before = (
                events_of(*displaced(viewer, numbers + sign * part * change), order, end) for sign in (1, -1)
            )
            step = after - before
            step[:, 0] = np.angle(np.exp(1j * step[:, 0]))
            slopes.append(step / (2 * part * change[k]))
        wide, close = slopes
        true, doubt = (4 * close - wide) / 3, np.abs(close - wide)
        noise = NOISE * (1 + np.abs(whole)) + NOISE * np.abs(true)
        assert (np.abs(mine[..., k] - true) < 3 * error + doubt + noise).all(), (k, mine[..., k] - true)


@pytest.mark.slow
def test_events_on_the_equator_do_not_feel_which_side_the_viewer_is_on():
    """The mirror at the equator: by inclination, events of mirrored paths change by opposite amounts."""
    camera = kc.Camera(0.999, 6.03)
    north, south = (kc.event_derivatives(camera, kc.pair_events(camera, level)) for level in (1.34, math.pi - 1.34))
    assert north.parameters == ("spin", "radius", "inclination", "theta")
    signs = np.array([1.0, 1.0, -1.0, -1.0])
    for one, other, error in zip(north.azimuth, south.azimuth, north.error[:, 0], strict=True):
        assert np.abs(one - signs * other).max() < 4 * error * np.abs(one).max()


@pytest.mark.slow
def test_events_of_other_paths_are_refused():
    camera = kc.Camera(0.999, 6.03)
    circle = kc.circle_images(camera, (0.3, 0.1), 2)
    assert len(circle.events)
    with pytest.raises(ValueError, match=r"^Argument `events` must be those of a source that circles"):
        kc.event_derivatives(camera, circle.events)
    with pytest.raises(ValueError, match=r"^Argument `events` must be PairEvents, but is list"):
        kc.event_derivatives(camera, [])
    with pytest.raises(ValueError, match=r"^Argument `events` must be those that `camera` sees"):
        kc.event_derivatives(kc.Observer(spin=0.999, inclination=1.2), kc.pair_events(camera, 1.34))
