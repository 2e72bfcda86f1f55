"""Answers of the page without a server: texts, ranges and fields as the program has them, and pictures."""

import json
from operator import itemgetter

import numpy as np
import pytest
from living import answered

from kerrcaustics.explorer.answers import orbit_of
from kerrcaustics.explorer.backdrops import window_view
from kerrcaustics.explorer.limits import allowed, nearest
from kerrcaustics.explorer.live_page import rules
from kerrcaustics.explorer.page_data import view_of
from kerrcaustics.explorer.page_script import LIVE
from kerrcaustics.explorer.state import PAGE, PRESETS, ExplorerState
from kerrcaustics.scenes.checkerboard import Checkerboard
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.tones import tone_mapped
from kerrcaustics.spacetime.sphere import from_angles

STATES = [
    *PRESETS.values(),
    ExplorerState(0.0, 6.03, 90.0, "static", 1, 0.0, 0.0),
    ExplorerState(0.9999, 1.0244, 90.0, "fiducial", 4, 180.0, -359.999),
    ExplorerState(0.123456789012345, 1000.0, 45.5, "fiducial", 2, 1e-5, 360.0, size=1e-6, frequency=0.05),
    ExplorerState(0.7, 2.5, 0.0, "fiducial", 3, 12.0, 1e4 / 3, size=20.0, frequency=1000.0, backdrop="stars"),
    ExplorerState(1 / 3, 123.456789, 179.999999, "static", 3, 90.0, 36000.0, chart="globe", sphere="outside"),
]
# Cameras that are moved, or lose their velocity, or are refused.
ODD = [
    {"spin": 0.5, "radius": 1.2},
    {"spin": 0.999, "radius": 1.9, "velocity": "static"},
    {"inclination": 60, "velocity": "circular"},
    {"spin": 0.0, "radius": 2.5, "velocity": "circular"},
    {"spin": 1.5},
    {"radius": 0.3},
    {"radius": 2000},
    {"theta": -1e-7},
    {"size": 1e-9},
    {"frequency": 1e6},
    {"orders": 9},
    {"velocity": "retrograde"},
    {"chart": "flat"},
]


def as_json(value):
    return json.loads(json.dumps(value))


def test_every_file_is_joined_and_short():
    files = {path.stem: path.read_text(encoding="utf-8") for path in (PAGE / "live").glob("*.js")}
    assert sorted(files) == sorted(LIVE)
    assert max(len(text.splitlines()) for text in files.values()) <= 260


def test_texts_and_ranges_are_those_of_the_program():
    records = json.dumps([state.record() for state in STATES])
    found = answered(
        f"return {records}.map((s) => [addressOf(s, data.rules), commandsOf(s), pythonOf(s), hasOrbit(s), "
        "allowedOf(s, data.rules)]);"
    )
    for state, (address, commands, python, has_orbit, ranges) in zip(STATES, found, strict=True):
        assert address == state.address()
        assert commands == state.commands() and python == state.python()
        assert has_orbit == state.has_orbit
        assert ranges == as_json(allowed(state))


def test_a_state_that_cannot_be_is_moved_or_refused_as_by_the_program():
    one = "(given) => { try { return checkedState(given, data.rules); } catch (error) { return error.message; } }"
    found = answered(f"return {json.dumps(ODD)}.map({one});")
    for given, answer in zip(ODD, found, strict=True):
        try:
            state = nearest(ExplorerState.read(given))
            state.check()
            assert answer == state.record()
        except ValueError as error:
            assert answer == str(error)


def test_rules_are_as_json_has_them():
    assert as_json(rules())["usual"] == ExplorerState().record()
    assert set(rules()["ranges"]) | set(rules()["choices"]) == set(ExplorerState().record())


@pytest.mark.parametrize("quality", ["full", "draft", "star"])
def test_views_have_the_fields_of_the_program_and_its_numbers(quality):
    # The program knows no camera whose curves are asked for coarsely.
    state = ExplorerState(spin=0.5 if quality != "draft" else 0.51, theta=84.6, phi=323.0)
    view = answered(f"const v = ask('{quality}', {json.dumps(state.record())});" + PLAIN)
    message = view_of(state, quality)
    assert set(view) - {"arrays", "id", "want"} == set(message.record)
    assert set(view["arrays"]) == set(message.arrays)
    assert view["state"] == message.record["state"] and view["quality"] == quality
    if quality != "star":
        assert np.allclose(view["axes"], message.record["axes"], atol=1e-12)
        assert np.allclose(view["arrays"]["edge"], message.arrays["edge"], atol=1e-12)
        assert [set(curve) for curve in view["caustics"]] == [set(curve) for curve in message.record["caustics"]]
    if quality == "full":
        for own, curve in zip(view["caustics"], message.record["caustics"], strict=True):
            assert (own["order"], own["kind"], len(own["cusps"])) == (curve["order"], curve["kind"], 4)
            for name in ("theta_extent", "phi_extent", "circuits"):
                assert own[name] == pytest.approx(curve[name], rel=1e-8)
    if quality != "draft":
        images = message.record["images"]
        assert set(view["images"]) == set(images)
        for name in ("index", "parity", "per_index", "expected", "on_caustic", "certified", "remarks"):
            assert view["images"][name] == images[name], name
        assert np.allclose(view["images"]["sky"], images["sky"], atol=1e-9)
        assert np.allclose(view["images"]["azimuth"], images["azimuth"], atol=1e-7)
        assert np.allclose(view["images"]["magnification"], images["magnification"], rtol=1e-7)


# Arrays of an answer as lists.
PLAIN = """
const rows = ({ data, shape }) => shape.length < 2 ? [...data] :
  Array.from({ length: shape[0] }, (_, i) => [...data.subarray(i * shape[1], (i + 1) * shape[1])]);
return { ...v, arrays: Object.fromEntries(Object.entries(v.arrays).map(([name, array]) => [name, rows(array)])) };
"""


def test_a_draft_of_a_camera_that_is_known_is_whole():
    first, second, third = answered("return ['draft', 'full', 'draft'].map((want) => ask(want).quality);")
    assert (first, second, third) == ("draft", "full", "full")


@pytest.mark.slow
def test_orbits_have_the_fields_of_the_program_and_its_events():
    state = ExplorerState(spin=0.5, theta=86.0, phi=270.0)
    orbit = answered(f"const v = ask('orbit', {json.dumps(state.record())});" + PLAIN)
    message = orbit_of(state)
    assert set(orbit) - {"id", "want"} == {*message.record, "arrays"}
    # The program joins the tracks of pairs at their events; the page ends them there.
    assert {name for name in message.arrays if "track" not in name and "light" not in name} < set(orbit["arrays"])
    assert len(orbit["tracks"]) >= len(message.record["tracks"])
    assert orbit["period"] == pytest.approx(message.record["period"], rel=1e-12)
    assert orbit["certified"] and message.record["certified"]
    pairs = [sorted(events, key=itemgetter("order", "part")) for events in (orbit["events"], message.record["events"])]
    for own, event in zip(*pairs, strict=True):
        assert (own["kind"], own["order"]) == (event["kind"], event["order"])
        assert own["part"] == pytest.approx(event["part"], abs=1e-7)
    assert np.allclose(orbit["arrays"]["phi"], message.arrays["phi"], atol=1e-9)
    assert orbit["arrays"]["first"] == message.arrays["first"].tolist()


def test_layers_of_the_program_and_broken_questions_are_refused():
    orbit = answered("return ask('orbit', { velocity: 'static', spin: 0 });")
    assert orbit["kind"] == "refusal" and "must orbit the spin axis" in orbit["line"] and orbit["want"] == "orbit"


def test_the_checkerboard_is_that_of_the_program():
    """Swatch by swatch, away from the edges, where the program averages."""
    theta, phi = np.meshgrid((np.arange(15) + 0.5) * np.pi / 15, (np.arange(30) + 0.5) * np.pi / 15, indexing="ij")
    places = from_angles(theta.ravel(), phi.ravel())
    nothing = np.zeros(len(places))
    seen = Footprint(places, np.zeros((len(places), 2, 2)), nothing, nothing + 1)
    colours = tone_mapped(Checkerboard().light(seen, beaming=False, colour_shift=False), exposure=1.0)
    board = "const board = new Checkerboard(data.rules.checkerboard);"
    found = answered(f"{board} return {json.dumps(places.tolist())}.map((n) => board.pixel(...n));")
    assert np.abs(np.array(found) - colours).max() <= 1


def test_pixels_of_a_window_look_where_the_program_looks():
    state = ExplorerState(spin=0.9, radius=4.0, inclination=60.0, velocity="fiducial")
    window, size = (3.0, -20.0, 80.0), 32
    view = window_view(state.camera(), window)
    grid = (np.arange(size) + 0.5) * view.width / size - 0.5
    sky, _ = view.directions(*np.meshgrid(grid, grid))
    found = answered(
        f"const v = ask('draft', {json.dumps(state.record())});return [...windowSky(v.axes, {[*window]}, {size})];"
    )
    assert np.allclose(np.reshape(found, (size, size, 3)), sky, atol=1e-12)


def test_pictures_have_the_shadow_and_the_sky():
    lensed, celestial, window = answered("""
      const { window, arrays } = ask("backdrop", { backdrop: "checkerboard" }, { window: [0, 0, 60] });
      const [rows, columns] = arrays.lensed.shape;
      const at = (row, column) => [...arrays.lensed.data.slice(4 * (row * columns + column)).subarray(0, 4)];
      return [[rows, columns, at(rows / 2, columns / 2), at(2, 2)], arrays.celestial.shape, window];
    """)
    rows, columns, middle, corner = lensed
    assert rows == columns and middle == [0, 0, 0, 255] and sum(corner) > 300
    assert celestial == [360, 720, 4] and window == [0, 0, 60]


def test_the_newest_question_of_each_kind_is_answered_views_first():
    told = answered("""
      const told = [];
      const scope = { postMessage: ({ kind, id }) => told.push([kind, id]) };
      answerMessages(scope);
      const { usual } = data.rules;
      const kernels = Uint8Array.from(atob(data.plain), (c) => c.charCodeAt(0));
      const post = (message) => scope.onmessage({ data: message });
      post({ id: 1, want: "backdrop", state: usual });
      post({ id: 2, want: "draft", state: usual });
      post({ id: 3, want: "draft", state: usual });
      post({ id: 4, want: "star", state: { ...usual, theta: 300 } });
      post({ kernels, layout: data.layout, rules: data.rules });
      for (let i = 0; i < 200 && told.length < 3; i++) await new Promise((go) => setTimeout(go, 20));
      setTimeout(() => process.exit(0), 0);
      return told;
    """)
    assert told == [["ready", None], ["refusal", 4], ["backdrop", 1]]
