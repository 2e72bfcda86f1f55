"""Travel times of all that is seen, for every surface and every viewer: against integrated rays, and each other."""

import math

import numpy as np
import parity
import pytest

import kerrcaustics as kc

TIMED = ("star_images", "pair_events", "star_tracks", "circle_images", "crossings_of_line")
# Of the fast tests.
QUICK = ("star_images", "pair_events", "circle_images")
CELLS = [
    pytest.param(
        cell,
        id=str(cell),
        marks=[] if cell[1:] == ("sky", "near") and cell.analysis in QUICK else pytest.mark.slow,
    )
    for cell in parity.cells()
    if cell.analysis in TIMED and not parity.refusal_of(cell)
]
# Where sources meet caustics: surface, viewer, order of the caustic.
MEETINGS = [
    ("sky", "near", 1),
    ("sky", "infinity", 2),
    ("beyond", "near", 1),
    ("within", "near", 1),
    ("within", "infinity", 1),
    ("plane", "near", 2),
    ("plane", "infinity", 2),
]


def parts_of(answer):
    """All in an answer that has places on the sky and times."""
    if hasattr(answer, "sky"):
        return [answer]
    names = [name for name in ("tracks", "curves", "events", "ends") if hasattr(answer, name)]
    return [part for name in names for part in getattr(answer, name)]


def integrated(viewer, sky, end):
    """Times and their errors (arrivals, n), by the integrator at its finest, of each arrival of the rays."""
    arrivals = end.arrivals() if isinstance(end, kc.Sphere) and end.radius < viewer.radius else (end,)
    rays = [kc.trace_rays(viewer, sky, "integrated", 1e-12, end=arrival, time=True) for arrival in arrivals]
    return np.stack([ray.time for ray in rays]), np.stack([ray.time_error for ray in rays])


@pytest.mark.slow
@pytest.mark.parametrize("cell", CELLS)
def test_times_are_those_of_integrated_rays(cell):
    viewer, parts = parity.viewer_named(cell.viewer), parts_of(parity.CALLS[cell.analysis](cell))
    if not parts:
        assert cell.analysis == "pair_events"
        return
    sky = np.concatenate([np.reshape(part.sky, (-1, np.shape(part.sky)[-1])) for part in parts])
    time, error = (np.concatenate([np.atleast_1d(getattr(p, name)) for p in parts]) for name in ("time", "time_error"))
    assert np.isfinite(time).all() and (error > 0).all() and (error < 1e-6 * np.maximum(viewer.radius, 1)).all()
    end = parity.end_for(cell.surface, cell.viewer)
    if not isinstance(end, kc.EquatorialPlane):
        end = kc.CelestialSphere() if math.isinf(end) else kc.Sphere(end)
    true, doubt = integrated(viewer, sky, end)
    away = np.nan_to_num(np.abs(time - true) - error - doubt, nan=np.inf).min(axis=0)
    assert (away <= 0).all(), (away.max(), error[away.argmax()])


def met(viewer, order, end):
    """An event of a caustic, and the distance in longitude to the next one: half way up the caustic."""
    curve = next(curve for curve in kc.caustics(viewer, order, end=end) if curve.order == order)
    level = float(np.quantile(curve.place[:, 0], 0.4))
    events = [event for event in kc.pair_events(viewer, level, order, end=end) if event.order == order]
    assert events and not any(event.at_cusp for event in events)
    phi = sorted(event.star[1] for event in events)
    gaps = [abs(math.remainder(phi[i] - phi[i - 1], 2 * math.pi)) for i in range(len(phi))]
    return events[0], min([1e-2, *(gap for gap in gaps if gap > 0)])


def pair_time(viewer, event, step, end):
    """The mean time of the two images of a source beside an event."""
    images = kc.star_images(viewer, (event.star[0], event.star[1] + step), event.order, end=end)
    assert images.certified
    pair = []
    for index in event.indices:
        own = np.flatnonzero(images.index == index)
        pair.append(own[np.linalg.norm(images.sky[own] - event.sky, axis=1).argmin()])
    return images.time[pair].mean(), abs(np.diff(images.time[pair])[0])


@pytest.mark.slow
@pytest.mark.parametrize(("surface", "viewer_name", "order"), MEETINGS)
def test_an_event_has_the_time_at_which_its_two_images_meet(surface, viewer_name, order):
    """Beside it, in the steps of a source, their mean is linear: its limit is the time of the event."""
    viewer, end = parity.viewer_named(viewer_name), parity.end_for(surface, viewer_name)
    event, width = met(viewer, order, end)
    step = 2e-3 * width
    counts = [
        kc.image_counts(viewer, [(event.star[0], event.star[1] + side * step)], order, end=end).total[0]
        for side in (-1, 1)
    ]
    assert abs(counts[1] - counts[0]) == 2
    step *= 1 if counts[1] > counts[0] else -1
    (far, _), (near, apart) = (pair_time(viewer, event, part * step, end) for part in (1, 0.5))
    limit = 2 * near - far
    assert abs(limit - event.time) <= 0.02 * abs(far - near) + 1e-10
    # The two differ by the power 3/2 of the step, so that each is close too.
    assert apart < 10 * abs(step) * max(1, abs(event.time))
