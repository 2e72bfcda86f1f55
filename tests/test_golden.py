"""The comparison of two records finds what it must, and lets pass what it may: on made-up records."""

import json

import numpy as np
import pytest
from golden.compare import Passing, compare, error_of

EVENT = {"kind": "PairEvent", "fields": {"time": 2.0, "indices": {"tuple": [0, 1]}}}
AZIMUTH, ERROR = np.array([0.5, 1.5, np.nan]), np.array([1e-9, 1e-6, np.nan])
STEP = np.array([0, 2e-6, 0])
COST = {"requests": 3, "rays": 0, "beams": 40}


@pytest.fixture
def made(tmp_path):
    """Makes a record of two entries: a saved result with some fields, and a command."""

    def make(name, cost=COST, says="none", **fields):
        folder = tmp_path / name
        folder.mkdir()
        parts = {"azimuth": AZIMUTH, "error": ERROR, "seconds": 1.0, "events": {"tuple": [EVENT]}} | fields
        arrays = {key: value for key, value in parts.items() if isinstance(value, np.ndarray)}
        parts |= {key: {"array": key, "shape": [3], "dtype": "<f8"} for key in arrays}
        head = {"schema": "kerrcaustics/result/1", "result": {"kind": "StarTracks", "fields": parts}}
        np.savez(folder / "api.npz", head=np.array(json.dumps(head)), **arrays)
        (folder / "cli.json").write_text(json.dumps({"status": 0, "json": {"rows": [[1, None], [2, 3]], "says": says}}))
        entries = {"api": {"file": "api.npz", **cost}, "cli": {"file": "cli.json", **COST}}
        (folder / "index.json").write_text(json.dumps({"entries": entries}))
        return folder

    return make


@pytest.fixture
def reported(made, capsys):
    """Compares a record with one that has changes: the status, and the lines on entries that are not equal."""

    def compared(renamed=(), passing=None, **changes):
        status = compare(made("old"), made("new", **changes), "*", list(renamed), passing or Passing())
        lines = capsys.readouterr().out.splitlines()[:-1]
        return status, [line.strip() for line in lines if not line.endswith(": equal to the bit")]

    return compared


def test_what_is_the_same_is_equal_whatever_time_it_took(reported):
    assert reported(seconds=9.0) == (0, [])


def test_a_changed_number_is_reported_in_units_of_its_error(reported):
    assert reported(azimuth=AZIMUTH + STEP) == (1, ["api: azimuth: at most 2e-06 off, in 1 of 3, 2 of the error"])


def test_a_change_in_the_last_bit_is_reported(reported):
    status, (line,) = reported(error=ERROR * (1 + 2**-52))
    assert status == 1 and line.startswith("api: error: at most 2")


@pytest.mark.parametrize(
    ("passing", "status"), [(Passing(errors=3), 0), (Passing(errors=1), 1), (Passing(within=2e-6), 0)]
)
def test_differences_within_what_is_given_pass(passing, status, reported):
    assert reported(passing=passing, azimuth=AZIMUTH + STEP)[0] == status


def test_errors_in_radians_are_those_of_angles_in_degrees():
    fields = {("phi_deg",): np.array([90.0, 2.0]), ("error_rad",): np.array([1.0, np.pi])}
    assert error_of(fields, ("phi_deg",), fields[("phi_deg",)]).tolist() == pytest.approx([180 / np.pi, 180])
    assert error_of(fields, ("error_rad",), fields[("error_rad",)]) is None


def test_nan_where_there_was_a_number_never_passes(reported):
    assert reported(passing=Passing(1.0, 1e9), azimuth=np.array([0.5, np.nan, np.nan]))[0] == 1


@pytest.mark.parametrize("indices", [[0, 2], [0, 1, 1]])
def test_whole_numbers_do_not_pass(indices, reported):
    event = {"kind": "PairEvent", "fields": {"time": 2.0, "indices": {"tuple": indices}}}
    status, (line,) = reported(passing=Passing(10.0, 10.0), events={"tuple": [event]})
    assert status == 1 and line.startswith("api: events[].indices: ")


def test_fields_that_are_gone_and_new_are_reported(reported):
    event = {"kind": "Event", "fields": {"moment": 2.0, "indices": {"tuple": [0, 1]}}}
    expected = ["api:", "events[].time: gone", "events[].moment: new", "class PairEvent -> Event (passes)"]
    assert reported(events={"tuple": [event]}) == (1, expected)


@pytest.mark.parametrize("names", [["PairEvent.time=moment"], ["events.time=moment"], ["time=", "=moment"]])
def test_fields_and_classes_with_new_names_are_the_same(names, reported):
    event = {"kind": "Event", "fields": {"moment": 2.0, "indices": {"tuple": [0, 1]}}}
    assert reported([*names, "PairEvent=Event"], events={"tuple": [event]}) == (0, [])


def test_a_field_is_not_renamed_elsewhere(reported):
    assert reported(["StarTracks.time=moment"]) == (0, [])


def test_a_list_of_another_length_is_reported(reported):
    status, lines = reported(events={"tuple": [EVENT, EVENT]})
    assert status == 1 and "events.length: at most 1 off, in 1 of 1" in lines


def test_a_changed_text_is_reported(reported):
    assert reported(says="no pairs") == (1, ["cli: json.says: 'none' -> 'no pairs'"])


def test_more_beams_are_reported_and_fewer_requests_pass(reported):
    cost = {"requests": 2, "rays": 0, "beams": 41}
    assert reported(cost=cost) == (1, ["api:", "equal to the bit", "requests: 3 -> 2 (passes)", "beams: 40 -> 41"])


@pytest.mark.parametrize(("factor", "status"), [(1.1, 0), (1.01, 1)])
def test_a_little_more_may_pass(factor, status, made):
    new = made("new", cost=COST | {"beams": 41})
    assert compare(made("old"), new, "*", [], Passing(cost=factor)) == status


def test_a_lost_entry_is_reported(made, capsys):
    old, new = made("old"), made("new")
    index = json.loads((new / "index.json").read_text())
    del index["entries"]["cli"]
    (new / "index.json").write_text(json.dumps(index))
    assert compare(old, new, "*", [], Passing()) == 1
    assert "cli: gone" in capsys.readouterr().out


def test_a_refusal_is_reported(made, capsys):
    old, new = made("old"), made("new")
    (new / "cli.json").write_text(json.dumps({"refused": "ValueError: no."}))
    assert compare(old, new, "cli", [], Passing()) == 1 and compare(new, old, "cli", [], Passing()) == 1
    out = capsys.readouterr().out
    assert "cli: is refused: 'ValueError: no.'" in out and "cli: was refused, and is answered:" in out
