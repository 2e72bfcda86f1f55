"""Every study runs, on very few rays, and writes what it promises."""

import json
import math

import numpy as np
import pytest
from test_cli import run

import kerrcaustics as kc
from kerrcaustics.report.records import find_records
from kerrcaustics.scripts import STUDIES, ScriptFolder

SETTINGS = {
    "accuracy": {"directions": 64, "repeats": 1, "methods": (("integrated", 1e-10), ("closed-form", 1e-10))},
    "astroids": STUDIES.load("astroids").SMALL,
    # Programs that other tests compile too.
    "cost": {"directions": 64, "repeats": 1, "scenes": (("rays", False, {}), ("beams", True, {}))},
    "far_camera": STUDIES.load("far_camera").SMALL,
    "inclination": STUDIES.load("inclination").SMALL,
    "open_questions": STUDIES.load("open_questions").SMALL,
    "orders": STUDIES.load("orders").SMALL,
    "spin_radius": STUDIES.load("spin_radius").SMALL,
    "stability": {"rays": 16, "truths": 1, "most": 1},
}


def test_every_study_is_tried_here():
    assert set(STUDIES.names()) == set(SETTINGS)


SLOW = {
    name: pytest.mark.slow
    for name in (
        "accuracy",
        "astroids",
        "far_camera",
        "inclination",
        "open_questions",
        "orders",
        "spin_radius",
        "stability",
    )
}


@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW.get(name, ())) for name in SETTINGS])
def test_study_writes_its_files(name, tmp_path, capsys):
    files = STUDIES.load(name).main(tmp_path, **SETTINGS[name])
    assert {file.name for file in files} == {path.name for path in tmp_path.iterdir()}
    entry = json.loads((tmp_path / f"{name}.json").read_text())
    assert entry["schema"] == f"kerrcaustics/study/{name}/1"
    assert entry["version"] and entry["machine"]["processor"] and entry["machine"]["jax"]
    assert (tmp_path / f"{name}.md").read_text().count("| ---") > 0
    # The report takes it, with its picture and its tables.
    (record,) = find_records(tmp_path)
    assert record.name == name and record.date and record.about == STUDIES.docstring(name) and record.tables
    assert record.findings and all(text.endswith(".") and "nan" not in text for text in record.findings)
    assert record.settings and record.seconds > 0
    assert (tmp_path / f"{name}.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    if name == "astroids":
        rows = entry["caustics"]
        random = [row for row in rows if row["camera"].startswith("random")]
        assert len(random) == 4 and all(row["verdict"] == "astroid" and row["cusps"] == 4 for row in random)
        assert {row["verdict"] for row in rows if row["spin"] == 0} == {"too small"} and len(entry["exceptions"]) >= 4
        assert all((row["deviation"] or 0) < 1 and (row["mirror"] or 0) < 1 for row in rows)
    if name == "orders":
        for end in entry["ends"]:
            reached = [pair for pair in zip(end["true_error"], end["error"], strict=True) if pair[1] is not None]
            assert len(reached) == 3 and all(true < reported for true, reported in reached)
            assert abs(end["drift_excess"][1]) < abs(end["drift_excess"][0]) / 10
        (size,) = entry["growth"]
        steps = [math.tan(math.pi / 2 - gap) for gap in size["polar_gap"]]
        assert size["circuits"][2] - size["circuits"][1] == pytest.approx(size["circuits_limit"], rel=0.05)
        assert steps[2] - steps[1] == pytest.approx(size["cot_limit"], rel=0.1)
    if name == "stability":
        # On a busy machine a problem may be given up: one engine fails, the others are not examined.
        assert {row["verdict"] for row in entry["problems"]} <= {"ok", "honest", "FAIL", "not examined"}
        assert all((row["verdict"] == "FAIL") == bool(row["faults"]) for row in entry["problems"])
    assert capsys.readouterr().out.strip()


def test_command_runs_a_study_and_names_its_files(tmp_path, capsys, monkeypatch):
    module = type("Study", (), {"main": staticmethod(lambda output: [output / "cost.json"])})
    monkeypatch.setattr(ScriptFolder, "load", lambda _, name: module)
    status, out, err = run(capsys, "study", "cost", "--output", tmp_path / "new")
    assert (status, err) == (0, "") and str(tmp_path / "new" / "cost.json") in out


def test_unknown_study_is_one_line_and_status_2(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = run(capsys, "study", "alchemy")
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert (
        "accuracy, astroids, cost, far_camera, inclination, open_questions, orders, spin_radius, stability" in err
        and "alchemy" in err
    )
    assert list(tmp_path.iterdir()) == []


def test_without_a_checkout_a_study_is_refused(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("kerrcaustics.scripts.STUDIES", ScriptFolder("study", tmp_path / "studies"))
    status, _, err = run(capsys, "study", "cost")
    assert status == 2 and err.count("\n") == 1 and "checkout" in err


@pytest.mark.slow
def test_the_secondary_caustic_winds_where_the_study_says():
    study = STUDIES.load("spin_radius")
    found = study.winding(0.999, 1)
    # Another program has 1.013 circuits at r = 2.6: 364.60 degrees, and 0.731 at 6.03.
    assert 2.6 < found.radius < 3.0 and found.error < 1e-7
    for side in (-1, 1):
        circuits = study.secondary_circuits(0.999, found.radius + 10 * side * found.error)[0]
        assert math.copysign(1, circuits - 1) == -side
    # Extent in phi' of a slower hole's caustic never reaches a whole turn.
    assert study.winding(0.9, 1) is None


def test_limits_are_right_within_their_errors_and_those_are_small():
    limits = STUDIES.load("limits")
    x = np.geomspace(0.02, 0.3, 14)
    error = 1e-10 / x**4
    found = limits.series(x, np.exp(3 * x) / (1 + x) + error * np.cos(40 * np.arange(14)), error, 2)
    for measured, true in zip(found, (1.0, 2.0), strict=True):
        assert abs(measured.value - true) < 2 * measured.error < 0.1
    # A power that is there and left out shows as an error that is not small.
    wrong = limits.series(x, 1 + x, np.full(14, 1e-12), 1, (0, *range(2, 12)))[0]
    assert wrong.error > 1e-5
    assert str(limits.Measured(0.36815539, 2.2e-7)) == "0.3681554(2)"
    assert str(limits.Measured(1.0, 0.0099)) == "1.00(1)" and str(limits.Measured(1234.5, 20.0)) == "1234(20)"
    with pytest.raises(ValueError, match="Argument `x` must hold 4 values"):
        limits.series(x[:3], x[:3], x[:3], 2)


@pytest.mark.slow
def test_the_tube_of_a_far_observer_is_as_wide_as_the_caustic_of_a_near_camera():
    section = STUDIES.load("far_camera_tube").section(0.9, 90.0, 25.0)
    camera = kc.Camera(0.9, 25.0, velocity="fiducial")
    width = kc.caustics(camera, orders=1)[0].phi_extent * (25.0 / 0.9) ** 2
    # On the equator a ray traced the other way is the same ray; the observer is at 1e8.
    assert abs(section.along.value - width) < 1e-6 and section.along.error < 1e-6
    assert abs(section.across.value - width) > 1e-3


@pytest.mark.slow
def test_the_secondary_caustic_stops_winding_where_the_study_says():
    study = STUDIES.load("inclination")
    found = study.winding(0.999, 2.6, 2)
    assert 80 < found.inclination < 90 and found.error < 1e-7
    for side in (-1, 1):
        turns = study.circuits(0.999, 2.6, 2, found.inclination + 100 * side * found.error)[0]
        assert math.copysign(1, turns - 1) == side
    assert study.winding(0.999, 6.03, 2) is None


@pytest.mark.slow
def test_studies_find_the_limits_of_theory(tmp_path):
    far, near = STUDIES.load("far_camera"), STUDIES.load("inclination")
    settings = far.SMALL | {"radii": far.RADII}
    far.main(tmp_path, **settings)
    for one in json.loads((tmp_path / "far_camera.json").read_text())["primary"]:
        for limit, theory in ((one["phi"][0], far.WIDTH), (one["theta"][0], far.WIDTH), (one["shift"][1], far.SHIFT)):
            assert abs(limit["value"] - theory) < 2 * limit["error"] < 1e-4
    near.main(tmp_path, **near.SMALL)
    powers = {"theta_extent": 2, "phi_extent": 1, "caustic_area": 4}
    for law in json.loads((tmp_path / "inclination.json").read_text())["near_axis"]:
        miss = abs(law["power"]["value"] - powers[law["quantity"]])
        assert miss < 2 * law["power"]["error"] + 1e-3 and law["power"]["error"] < 0.2
