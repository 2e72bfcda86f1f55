"""The search of the page without a server against that of the program: curves, images, counts, certificates, orbits."""

import json
import math
from functools import cache

import numpy as np
import pytest
from living import answered

from kerrcaustics.beams.kernels.trees import leaves
from kerrcaustics.explorer.answers import orbit_of
from kerrcaustics.explorer.limits import nearest
from kerrcaustics.explorer.page_data import view_of
from kerrcaustics.explorer.state import MOST_RADIUS, MOST_SPIN, PRESETS, ExplorerState
from kerrcaustics.spacetime.kerr import horizon

# States asked for in one process, whose time is limited.
BATCH = 50
EXTREMES = ("theta_min", "theta_max", "phi_min", "phi_max")


@cache
def random_states(count):
    """Those of figures, and others; many next to the horizon, far away, on the axis, in the plane or nearly so."""
    rng = np.random.default_rng(71)
    states = list(PRESETS.values())
    while len(states) < count:
        spin = float(rng.choice([0, MOST_SPIN, 0.998, rng.uniform(), rng.uniform(), 1 - 10 ** rng.uniform(-4, 0)]))
        low = float(horizon(min(spin, MOST_SPIN)))
        radii = [1.05 * low, low * (1 + 10 ** rng.uniform(-1.9, 1)), 10 ** rng.uniform(0.5, 3), 2.6, MOST_RADIUS]
        inclinations = [90, 90, rng.uniform(0, 180), rng.uniform(0, 180), 0, 180, rng.uniform(88, 92), 1e-3]
        state = ExplorerState(
            spin=min(spin, MOST_SPIN),
            radius=float(min(max(rng.choice(radii), 1), MOST_RADIUS)),
            inclination=float(rng.choice(inclinations)),
            velocity=str(rng.choice(["circular", "fiducial", "static"])),
            orders=int(rng.choice([1, 2, 3, 3, 3])),
            theta=math.degrees(math.acos(rng.uniform(-1, 1))),
            phi=float(rng.uniform(0, 360)),
        )
        states.append(nearest(state))
    return states[:count]


def live_views(states):
    """The records of views, and the arrays of the edges."""
    found = []
    for start in range(0, len(states), BATCH):
        records = json.dumps([state.record() for state in states[start : start + BATCH]])
        found += answered(f"""
          return {records}.map((state) => {{
            const view = ask("full", state);
            return {{ ...view, arrays: null, edge: [...view.arrays.edge.data] }};
          }});
        """)
    return found


def worst_miss(own, images):
    """The largest distance of images from those of the program, by the sum of both errors; inf if they are others."""
    if sorted(own["index"]) != sorted(images["index"]):
        return math.inf
    free, worst = set(range(len(images["index"]))), 0.0
    for index, sky, error in zip(own["index"], own["sky"], own["error"], strict=True):
        gaps = {i: math.dist(sky, images["sky"][i]) for i in free if images["index"][i] == index}
        best = min(gaps, key=gaps.__getitem__)
        free.remove(best)
        worst = max(worst, gaps[best] / math.radians(error + images["error"][best]))
    return worst


def agree(states):
    """Number of states of which both certify the images; asserts all that must agree."""
    certified = 0
    for state, own in zip(states, live_views(states), strict=True):
        view = view_of(state)
        images, record = own["images"], view.record
        theirs = record["images"]
        assert own["kind"] == "view", (state, own)
        # Where along the edge a point lies depends on the last digits of a table.
        assert np.allclose(np.reshape(own["edge"], (-1, 3)), view.arrays["edge"], atol=1e-6), state
        assert np.allclose(own["axes"], record["axes"], atol=1e-6), state
        if images["certified"]:
            # Never where the program finds another count.
            assert images["per_index"] == theirs["per_index"], (state, images, theirs)
        if images["certified"] and theirs["certified"]:
            certified += 1
            assert worst_miss(images, theirs) <= 1, state
            for name in ("magnification", "redshift"):
                pairs = sorted(zip(images["index"], images[name], strict=True))
                assert np.allclose(pairs, sorted(zip(theirs["index"], theirs[name], strict=True)), rtol=1e-7), state
        for curve in record["caustics"]:
            (mine,) = [one for one in own["caustics"] if one["order"] == curve["order"]]
            assert (mine["kind"], mine["closed"]) == (curve["kind"], curve["closed"]), (state, mine, curve)
            within = max(1e-9, mine["error"] + curve["error"])
            for name in EXTREMES:
                assert mine[name] == pytest.approx(curve[name], abs=within), (state, name)
            assert len(mine["cusps"]) == len(curve["cusps"]), state
    return certified


def test_curves_and_images_are_those_of_the_program():
    states = random_states(5)
    assert agree(states) == len(states)


@pytest.mark.slow
def test_curves_and_images_of_1000_states_are_those_of_the_program():
    states = random_states(1000)
    assert agree(states) >= 0.995 * len(states)


def test_frames_are_those_of_the_program():
    states = random_states(200)
    records = json.dumps([state.record() for state in states])
    found = answered(f"return {records}.map((state) => [...cameraOf(state).frame]);")
    for state, own in zip(states, found, strict=True):
        assert own == pytest.approx([*map(float, leaves(state.camera().frame()))], rel=2e-14, abs=1e-16), state


def test_a_star_on_a_caustic_is_never_certified():
    state = PRESETS["JTFT fig 6: a pair at r = 6.03"]
    found = answered(f"""
      const state = {json.dumps(state.record())},
        points = ask("full", state).arrays.caustic2.data;
      return [0, 40, 80, 120].map((i) => {{
        const images = ask("star", {{ ...state, theta: points[2 * i], phi: points[2 * i + 1] }}).images;
        return [images.certified, images.on_caustic];
      }});
    """)
    assert all(images == [False, [2]] for images in found)


def test_rings_are_said_and_not_counted():
    sees = {"spin": 0.0, "radius": 6.03, "inclination": 90.0, "velocity": "fiducial", "orders": 2}
    images = answered(f"return ask('full', {{ ...{json.dumps(sees)}, theta: 90, phi: 180 }}).images;")
    assert not images["certified"] and images["on_caustic"] == [1] and "one ring" in images["remarks"][0]
    theirs = view_of(ExplorerState(theta=90.0, phi=180.0, **sees)).record["images"]
    assert images["per_index"] == theirs["per_index"]


def compared_orbits(states):
    records = json.dumps([state.record() for state in states])
    found = answered(f"""
      return {records}.map((state) => {{
        const {{ arrays, ...orbit }} = ask("orbit", state);
        const [numbers, first, phi] = ["frame_numbers", "first", "phi"].map((name) => [...arrays[name].data]);
        return {{ ...orbit, numbers, first, phi }};
      }});
    """)
    for state, own in zip(states, found, strict=True):
        theirs = orbit_of(state)
        record, arrays = theirs.record, theirs.arrays
        assert own["certified"] == record["certified"], (state, own["remarks"], record["remarks"])
        assert own["period"] == pytest.approx(record["period"], rel=1e-13)
        assert own["phi"] == pytest.approx(arrays["phi"].tolist(), abs=1e-9)
        assert own["first"] == arrays["first"].tolist()
        indices = np.sort(np.reshape(own["numbers"], (-1, 3))[:, 0])
        assert np.array_equal(indices, np.sort(arrays["frame_numbers"][:, 0]))
        events = sorted(own["events"], key=lambda event: event["part"])
        expected = sorted(record["events"], key=lambda event: event["part"])
        assert [(one["kind"], one["order"], one["at_cusp"]) for one in events] == [
            (one["kind"], one["order"], one["at_cusp"]) for one in expected
        ], state
        for one, other in zip(events, expected, strict=True):
            assert one["phi"] == pytest.approx(other["phi"], abs=one["error"] + other["error"] + 1e-12)


ORBITING = [state for state in random_states(200) if state.has_orbit and 0 < state.inclination < 180]


def test_an_orbit_has_the_pair_events_of_the_program():
    compared_orbits([PRESETS["JTFT fig 7: tracks at r = 6.03"], PRESETS["JTFT fig 6: a pair at r = 6.03"]])


@pytest.mark.slow
def test_orbits_have_the_pair_events_of_the_program():
    compared_orbits(ORBITING[:40])


def test_tracks_run_from_event_to_event():
    state = PRESETS["JTFT fig 7: tracks at r = 6.03"]
    tracks, events = answered(f"""
      const {{ arrays, tracks, events }} = ask("orbit", {json.dumps(state.record())});
      return [tracks.map(({{ closed }}, i) => [closed, [...arrays[`track${{i}}`].data.slice(0, 3)],
        [...arrays[`track${{i}}`].data.slice(-3)]]), events.map(({{ sky }}) => sky)];
    """)
    open_ends = [end for closed, *ends in tracks if not closed for end in ends]
    assert open_ends
    for end in open_ends:
        assert min(math.dist(end, sky) for sky in events) < 1e-12
