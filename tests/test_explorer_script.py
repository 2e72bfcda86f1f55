"""The logic of the explorer's page, without a page."""

import json
from urllib.parse import parse_qsl

import numpy as np
import pytest
from exploring import evaluated

from kerrcaustics.explorer.page_data import view_of
from kerrcaustics.explorer.page_script import LOGIC, PARTS
from kerrcaustics.explorer.state import PAGE, PRESETS, ExplorerState


def test_every_part_is_joined_and_short():
    files = {path.stem: path.read_text(encoding="utf-8") for path in (PAGE / "parts").glob("*.js")}
    assert sorted(files) == sorted(PARTS)
    assert max(len(text.splitlines()) for text in files.values()) <= 260


def test_a_decimal_comma_is_a_point_and_nothing_else_is_guessed():
    texts = [
        "6,03",
        "0,7",
        " 6.03 ",
        ",5",
        "5.",
        "−4",
        "1e-3",
        "84",
        "",
        "1,234.5",
        "6 03",
        "6,0,3",
        "0x10",
        "Infinity",
    ]
    numbers = evaluated(f"return {json.dumps(texts)}.map(numberOf);")
    assert numbers == [6.03, 0.7, 6.03, 0.5, 5, -4, 0.001, 84, *[None] * 6]
    assert evaluated("return stateOf('#spin=0,7&radius=6,03');") == {"spin": 0.7, "radius": 6.03}


@pytest.mark.parametrize("state", PRESETS.values(), ids=PRESETS)
def test_addresses_are_read_and_written_as_the_program_does(state):
    read, written = evaluated(f"const s = stateOf('#{state.address()}'); return [s, fragmentOf(s)];")
    assert ExplorerState.from_values(read) == state
    assert dict(parse_qsl(written)) == dict(parse_qsl(state.address()))


def test_messages_are_read_as_they_are_written():
    message = view_of(ExplorerState(spin=0.9, orders=2), "draft")
    data = list(message.encoded())
    view = f"decoded(new Uint8Array({data}))"
    record, sky = evaluated(f"const view = {view}; return [view.state, curvesOf(view)[1].sky];")
    assert record == message.record["state"]
    assert sky == message.arrays["critical2"].astype(np.float32).astype(float).tolist()


def test_limbs_are_cut_where_the_index_changes():
    points = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 1, 1, 1]]
    array = {"data": [x for point in points for x in point], "shape": [4, 4]}
    # Arrays of messages are typed.
    limb = evaluated(
        f"const a = {json.dumps(array)}; a.data = Float32Array.from(a.data);"
        "return shapesOf({ arrays: { limb0: a } }).limbs[0];"
    )
    assert [arc["index"] for arc in limb["arcs"]] == [0, 1]
    assert limb["arcs"][1]["sky"] == [[0, 0, 1], [0, 1, 1], [1, 0, 0]] and len(limb["sky"]) == 4


def test_small_circles_have_their_radius():
    circle = np.array(evaluated("return smallCircle(place(50, 200), 7);"))
    (centre,) = np.array(evaluated("return [place(50, 200)];"))
    assert np.allclose(np.degrees(np.arccos(circle @ centre)), 7, atol=1e-10, rtol=0)
    assert np.allclose(circle[0], circle[-1], atol=1e-12, rtol=0)


@pytest.mark.parametrize(("low", "high"), [(0, 360), (-720.5, 1000), (83.123, 83.1231), (89.9999999, 90.0000001)])
def test_ticks_are_round_few_and_within(low, high):
    values = evaluated(f"return ticks({low}, {high}, 8);")
    assert 2 <= len(values) <= 9 and all(low <= value <= high for value in values)
    assert np.ptp(np.diff(values)) <= 1e-9


def test_the_newest_question_waits_and_curves_are_not_forgotten():
    sent, busy = evaluated(
        "const sent = [], state = { ...DEFAULTS }, q = new Questions((text) => sent.push(JSON.parse(text)));"
        "q.open = true;"
        "q.ask('full', state, 0, false); q.ask('full', state, 0, false); q.ask('star', { ...state, phi: 3 }, 0, false);"
        "q.answered({ id: 1, want: 'full' }); q.next('view'); return [sent, q.busy];"
    )
    assert [(one["id"], one["want"], one["state"]["phi"]) for one in sent] == [
        (1, "full", 295),
        (2, "full", 3),
    ] and busy


def test_a_question_about_a_disc_keeps_its_size_when_its_camera_is_put_right():
    """Else the light of the disc of before would be taken for that of the star of now."""
    state = evaluated(
        "const q = new Questions(() => {}), now = { ...DEFAULTS, radius: 1.5 }; q.open = true;"
        "q.ask('shapes', { ...now, size: 1 }, 0, true); q.settle(now, { ...now, radius: 2, size: 0 });"
        "return q.sent.shapes.state;"
    )
    assert (state["radius"], state["size"]) == (2, 1)


def test_pairs_are_placed_where_their_images_are():
    """Images of index 0, 1 become 0, 1, 1, 2: a pair of order 2, between its two images."""
    a, b = [0.6, 0.8, 0.0], [0.8, 0.6, 0.0]
    images = [(0, [1, 0, 0]), (1, [-1, 0, 0]), (1, a), (2, b)]
    after = [{"index": index, "sky": sky} for index, sky in images]
    born = evaluated(f"return pairsBorn({after[:2]}, {after}, 3, []);")
    assert [pair["order"] for pair in born] == [2]
    assert np.allclose(born[0]["sky"], np.sqrt([0.5, 0.5, 0]), atol=1e-15, rtol=0)


SHOWN = "{ view: { answer: { quality: 'full' }, request: { ...DEFAULTS } }, images: { request: { ...DEFAULTS } } }"


@pytest.mark.parametrize(
    ("changes", "curves", "images", "badge"),
    [
        ({}, "current", "current", "✓ 1 + 2 images, certified"),
        ({"chart": "globe", "backdrop": "stars"}, "current", "current", "✓ 1 + 2 images, certified"),
        ({"phi": 61.0}, "current", "old", "computing … 3 s"),
        ({"spin": 0.9}, "old", "old", "computing … 3 s"),
        ({"velocity": "static"}, "old", "old", "computing … 3 s"),
        ({"orders": 2}, "old", "old", "computing … 3 s"),
    ],
)
def test_only_what_the_controls_say_is_called_certified(changes, curves, images, badge):
    fresh, text, lost, early, dragged = evaluated(
        f"const fresh = freshnessOf({{ ...DEFAULTS, ...{changes} }}, {SHOWN});"
        "const badge = (wait) => badgeOf(fresh, [1, 2], true, { lost: '', seconds: 3.7, ...wait }).text;"
        "return [fresh, ...[{}, { lost: 'lost' }, { seconds: 0 }, { dragging: true }].map(badge)];"
    )
    assert fresh == {"curves": curves, "images": images} and text == badge
    assert lost == (badge if images == "current" else "not computed: no connection")
    # A moment after the star has moved, and while it does, nothing is said of what is shown.
    assert early == (badge if images == "current" else "1 + 2 images" if curves == "current" else "computing …")
    assert dragged == ("1 + 2 images" if images == "current" else badge)


def test_a_program_that_owes_an_answer_is_missed():
    silences = evaluated(
        "let now = 0; const q = new Questions(() => {}, () => now), found = [];"
        "const after = (time) => { now = time; found.push(q.silence); };"
        "q.begin(); after(9000); q.ask('full', DEFAULTS, 0, false); after(10000); q.works({ want: 'full' });"
        "after(12000); q.answered({ id: 1, want: 'full' }); after(30000); return found;"
    )
    assert silences == [0, 1000, 2000, 0]


@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        ("0", ""),
        ("1000", ""),
        ("-4", "-4 is not allowed: enter a number from 0 to 1000 M."),
        ("NaN", "Enter a number from 0 to 1000 M."),
    ],
)
def test_numbers_are_taken_within_their_range(value, complaint):
    assert evaluated(f"return complaintAbout({value}, [0, 1000], ' M');") == complaint


def test_words_have_their_place_where_no_curve_is():
    spot = "const spots = beside([100, 100], 40, 20); return clearSpot(spots, POINTS, 15, 8);"
    clear = lambda points: evaluated(spot.replace("POINTS", json.dumps(points)), (*LOGIC, "label_spots"))  # noqa: E731
    assert clear([]) == [100, 120] and clear([[90, 125], None]) == [100, 80]
    assert clear([[90, 125], [100, 80]]) == [140, 100]
    # Where all are taken, the first.
    assert clear([[100, 120], [100, 80], [140, 100], [60, 100]]) == [100, 120]


def test_what_is_waited_for_is_said():
    lines = evaluated("return [['program', 2], ['kernel', 0.4], ['kernel', 7.9]].map((one) => waitingLine(...one));")
    assert lines[:2] == ["Waiting for the program … 2 s", "Waiting for the kernel … 0 s"]
    assert lines[2] == "Waiting for the kernel … 7 s: it answers once the cells before have run"
