"""Every study runs, on very few rays, and writes what it promises."""

import inspect
import json
import math
import os
import threading

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.beams.engine import ENGINES
from kerrcaustics.report.machine import one_core
from kerrcaustics.report.study_records import find_records
from kerrcaustics.report.tables import ReportTable
from kerrcaustics.scripts import STUDIES, ScriptFolder
from kerrcaustics.sweeps.scene import Range

FAR = (0.999, 6.03, 90)
SETTINGS = {
    "accuracy": {"directions": 64, "repeats": 1, "methods": (("integrated", 1e-10), ("closed-form", 1e-10))},
    "adversary": {
        "cases": 2,
        "rays": 9,
        "sampled": 0.2,
        "analyses": 0,
        # At one tolerance.
        "trials": STUDIES.module("adversary.trials").TRIALS[1::3],
    },
    "astroids": {
        "cameras": 2,
        "orders": 2,
        "named": ("no spin", "0.001 degrees from the axis"),
        "shown": (("", 0.9, 6.03, 90.0),),
    },
    "cost": {
        "directions": 64,
        "repeats": 1,
        "scenes": (("rays", False, {}), ("beams", True, {})),
        "lines": ("three caustics",),
        "calls": 1,
        "first": ("three caustics",),
    },
    "disk_checks": {
        "rings": ((0.9, 60.0),),
        "turns": 96,
        "nodes": ((8, 32),),
        "sides": (32,),
        "finest": (16, 64),
        "rounds": 1,
    },
    # One result of each module.
    "error_time": {
        "results": tuple(
            result
            for result in STUDIES.module("error_time.main").RESULTS
            if result.line in ("ray", "pair events", "light curve, spot", "isoradials", "frame of rays alone")
        ),
        "sizes": STUDIES.module("error_time.points").Sizes(
            repeats=1, directions=64, tolerances=(1e-12,), times=4, spot_points=256, pixels=18, side=5
        ),
    },
    "extended_sources": {"count": 2},
    "far_camera": {
        "spins": (0.1, 0.2, 0.3, 0.4),
        "radii": Range(20.0, 200.0, 6, "log"),
        "inclined": ((0.3,), (60.0,)),
        "tubes": ((0.9, 90.0),),
        "tube_radii": (20.0, 30.0, 45.0, 70.0, 100.0),
        "orders": 2,
    },
    "fit": {"draws": 60},
    "inclination": {
        "spins": (0.9,),
        "radii": (6.03,),
        "inclinations": (0.0, 90.0),
        "near_sines": (0.0625, 0.125, 0.25, 0.5),
        "orders": 2,
    },
    "near_sources": {"spheres": 2, "planes": 2, "azimuths": 2},
    "open_questions": {name: (FAR,) for name in ("critical", "caustics", "orbits", "counted", "events")}
    | {"orders": 2, "stars": 8, "points": 4, "normals": 50, "steps": 4, "thetas": (60.0,)},
    "orders": {"spins": (0.5,), "orders": 3, "lines": 9, "inclinations": (90.0,)},
    "spin_radius": {"spins": (0.9, 0.99), "radii": Range(3.0, 6.0, 2), "winding_spins": (0.99,), "orders": 2},
    # However busy the machine is, nothing is given up.
    "stability": {
        "rays": 16,
        "truths": 1,
        "examined": STUDIES.module("stability.problems").problems()[:1],
        "longest": math.inf,
        "patience": math.inf,
        "gaps": (0.1, 1e-9),
        "heights": (1.0,),
        "distances": (math.inf, 1e-6),
    },
    "waves": {"cases": 6},
}


def test_every_study_is_tried_here():
    assert STUDIES.names() == list(SETTINGS)


def check_astroids(entry):
    rows = entry["caustics"]
    random = [row for row in rows if row["camera"].startswith("random")]
    assert len(random) == 4 and all(row["verdict"] == "astroid" and row["cusps"] == 4 for row in random)
    assert {row["verdict"] for row in rows if row["spin"] == 0} == {"too small"} and len(entry["exceptions"]) >= 4
    assert all((row["deviation"] or 0) < 1 and (row["mirror"] or 0) < 1 for row in rows)


def check_adversary(entry):
    rows = entry["claims"]["trial"]
    assert {row[0].split(",")[0] for row in rows} == {"closed-form", "integrated"}
    assert all(int(row[2]) > 0 for row in rows)


def check_cost(entry):
    ((name, line),) = entry["lines"].items()
    assert name == "three caustics" and entry["first_use"] == {name: line["first"]}
    assert line["first"].keys() == {"start", "tracing", "rest"} and min(line["first"].values()) > 0
    assert line["later"]["tracing"] > 0 and line["later"]["rest"] > 0 and line["speed_up"] > 0
    assert line["traced"]["beams"] > 1000
    each = entry["microseconds"]["closed-form"]
    alone = 1e-6 * (each[0] * line["traced"]["rays"] + each[-1] * line["traced"]["beams"])
    assert line["ratio"] == pytest.approx(sum(line["later"].values()) / alone)


def check_disk_checks(entry):
    assert [one["verdict"] for one in entry["checks"]] == ["holds"] * 20
    assert all(one["error"] < 0.05 for one in entry["work"] if one["method"] == "beams at nodes")


def check_error_time(entry):
    points = {(one["line"], one["setting"]): one for one in entry["points"]}
    assert len(points) == 11 and all(one["seconds"] > 0 for one in points.values())
    # Of rays alone nothing is reported.
    assert all((one["ratio"] is None) == (one["family"] == "pictures") for one in points.values())
    assert points["ray", "closed form"]["error"] < 1e-13 and points["pair events", "one more star"]["ratio"] < 1
    assert points["isoradials", "90 points"]["ratio"] < 1 and points["light curve, spot", "256 points"]["error"] < 1e-4
    rays = [points["frame of rays alone", f"{count} a pixel"]["error"] for count in (1, 4, 16)]
    assert rays == sorted(rays, reverse=True) and rays[2] > 1e-3


def check_extended_sources(entry):
    assert len(entry["discs"]) == 6 and "wrong" not in entry["verdicts"]
    answer = [disc for disc in entry["discs"] if disc["certified"] and disc["twin_error"] is not None]
    assert len(answer) >= 3
    for disc in answer:
        assert abs(disc["total"] - disc["twin"]) <= disc["error"] + 4 * disc["twin_error"] + 5e-4 * disc["twin"]


def check_waves(entry):
    assert set(entry["fields"]) == {"partial waves, no spin", "each other, with spin"}
    assert not entry["wrong"]
    off = [one["off"] / one["allowed"] for one in entry["fields"]["partial waves, no spin"] if one["method"] == "auto"]
    assert len(off) == 50 and 0.1 < max(off) < 1


def check_fit(entry):
    # Of 60 draws of two parameters: a mean of 2, known to 0.26.
    assert abs(entry["mean_square"] - 2) < 1
    assert all(0 < error < 0.1 for error in entry["standard_error"])


def check_near_sources(entry):
    assert len(entry["pairs"]) == 8 and "wrong" not in entry["verdicts"]
    assert all(row["certified"] and row["lacking"] == row["false"] == 0 for row in entry["pairs"])
    assert sum(row["images"] for row in entry["pairs"]) > 10


def check_orders(entry):
    for end in entry["ends"]:
        reached = [pair for pair in zip(end["true_error"], end["error"], strict=True) if pair[1] is not None]
        assert len(reached) == 3 and all(true < reported for true, reported in reached)
        assert abs(end["drift_excess"][1]) < abs(end["drift_excess"][0]) / 10
    (size,) = entry["growth"]
    steps = [math.tan(math.pi / 2 - gap) for gap in size["polar_gap"]]
    assert size["circuits"][2] - size["circuits"][1] == pytest.approx(size["circuits_limit"], rel=0.05)
    assert steps[2] - steps[1] == pytest.approx(size["cot_limit"], rel=0.1)


def check_stability(entry):
    assert [row["engine"] for row in entry["problems"]] == list(ENGINES)
    for row in entry["problems"]:
        assert (row["verdict"], row["faults"]) in [("ok", []), ("honest", [])]
        assert row["truths"] == 1 and row["escaped"] > 0
        assert row["shown"]["escaped"] == str(row["escaped"])
    assert [cell["distance"] for cell in entry["map"]] == [None, None, 1e-6, 1e-6]
    assert all(0 < cell["ratio"] < 10 for cell in entry["map"])


CHECKS = {
    "cost": check_cost,
    "adversary": check_adversary,
    "astroids": check_astroids,
    "disk_checks": check_disk_checks,
    "error_time": check_error_time,
    "extended_sources": check_extended_sources,
    "fit": check_fit,
    "near_sources": check_near_sources,
    "orders": check_orders,
    "stability": check_stability,
    "waves": check_waves,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SETTINGS)
def test_study_writes_its_files(name, tmp_path, capsys):
    study = STUDIES.load(name)
    files = study.main(tmp_path, **SETTINGS[name])
    assert {file.name for file in files} == {path.name for path in tmp_path.iterdir()}
    entry = json.loads((tmp_path / f"{name}.json").read_text())
    assert entry["schema"] == f"kerrcaustics/study/{name}/1"
    assert entry["version"] and entry["machine"]["processor"] and entry["machine"]["jax"]
    # The report takes it, with its picture and its tables.
    (record,) = find_records(tmp_path)
    assert record.name == name and record.date and record.about == inspect.cleandoc(study.__doc__)
    assert record.findings and all(text.endswith(".") and "nan" not in text for text in record.findings)
    assert record.settings and record.seconds > 0
    assert (tmp_path / f"{name}.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    # What the tables say is printed, too.
    lines = [row[0] for table in record.tables if isinstance(table, ReportTable) for row in table.rows]
    printed = capsys.readouterr().out
    assert lines and all(line in printed for line in lines)
    CHECKS.get(name, lambda _: None)(entry)


def test_stages_add_up_and_rays_are_counted():
    stages = STUDIES.module("cost.stages")
    camera, clock = kc.Camera(0.5, 20), iter(range(1000))
    with stages.watched(lambda: next(clock)) as watched:
        rays, beams = kc.trace_rays(camera, np.eye(3)), kc.trace_beams(camera, -np.eye(3)[:2])
    assert rays.escaped.any() and beams.escaped.any()
    assert watched.traced == {"rays": 3, "beams": 2}
    # Every tick belongs to a stage: one from each step to the next one.
    tracing, rest = (watched.seconds[name] for name in stages.STAGES)
    assert tracing >= 2 and tracing + rest == next(clock) - 1
    # Outside of the block nothing is counted.
    kc.trace_rays(camera, np.eye(3))
    assert watched.traced["rays"] == 3


def test_time_is_that_of_kernels_while_one_runs_in_any_thread():
    stages, now = STUDIES.module("cost.stages"), [0.0]
    spent = stages.Stages(lambda: now[0])
    with spent.in_kernel():
        now[0] = 1.0
        with spent.in_kernel():
            now[0] = 3.0
        now[0] = 7.0
    now[0] = 15.0
    spent.end()
    assert spent.seconds == {"tracing": 7.0, "rest": 8.0}


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no affinities")
def test_one_core_holds_threads_that_run_already():
    over = threading.Event()
    waiting = threading.Thread(target=over.wait)
    waiting.start()
    before = os.sched_getaffinity(0)
    try:
        with one_core():
            held = [os.sched_getaffinity(thread) for thread in (0, waiting.native_id)]
        assert held[0] == held[1] and len(held[0]) == 1
        assert [os.sched_getaffinity(thread) for thread in (0, waiting.native_id)] == [before, before]
    finally:
        over.set()
        waiting.join()


@pytest.mark.slow
def test_every_line_of_what_people_wait_for_can_be_asked_for_twice():
    lines = STUDIES.module("cost.lines")
    sizes = lines.Sizes(stars=20, times=20, rows=12, width=64, height=36)
    for name, line in lines.LINES.items():
        work = line(sizes)
        assert all(work(k) is not None for k in range(2)), name


def test_command_runs_a_study_and_names_its_files(tmp_path, capsys, monkeypatch):
    module = type("Study", (), {"main": staticmethod(lambda output: [output / "cost.json"])})
    monkeypatch.setattr(ScriptFolder, "load", lambda _, name: module)
    status, out, err = run(capsys, "study", "cost", "--output", tmp_path / "new")
    assert (status, err) == (0, "") and str(tmp_path / "new" / "cost.json") in out


def test_unknown_study_is_one_line_and_status_2(assert_refused):
    names = (
        "accuracy, adversary, astroids, cost, disk_checks, error_time, extended_sources, far_camera, fit, inclination, "
        "near_sources, open_questions, orders, spin_radius, stability, waves"
    )
    assert_refused(["study", "alchemy"], f"must be one of {names}, but is alchemy")


def test_without_a_checkout_a_study_is_refused(tmp_path, scripts_at, assert_refused):
    scripts_at("STUDIES", tmp_path / "studies")
    assert_refused(["study", "cost"], "checkout")


@pytest.mark.slow
def test_the_secondary_caustic_winds_where_the_study_says():
    study = STUDIES.load("spin_radius")
    found = study.winding(0.999, 1)
    # Another program has 1.013 circuits at r = 2.6: 364.60 degrees, and 0.731 at 6.03.
    assert 2.6 < found.radius < 3.0 and found.error < 1e-7 and found.confirmed
    assert not study.is_met(0.999, found.radius + 0.01, (1.0, math.inf)) and not study.is_met(0.999, 2.6, (0.0, 1.0))
    for side in (-1, 1):
        circuits = study.secondary_circuits(0.999, found.radius + 10 * side * found.error)[0]
        assert math.copysign(1, circuits - 1) == -side
    # Extent in phi' of a slower hole's caustic never reaches a whole turn.
    assert study.winding(0.9, 1) is None


def test_limits_are_right_within_their_errors_and_those_are_small():
    measured = STUDIES.module("measured")
    x = np.geomspace(0.02, 0.3, 14)
    error = 1e-10 / x**4
    found = measured.series(x, np.exp(3 * x) / (1 + x) + error * np.cos(40 * np.arange(14)), error, 2)
    for number, true in zip(found, (1.0, 2.0), strict=True):
        assert abs(number.value - true) < 2 * number.error < 0.1
    # A power that is there and left out shows as an error that is not small.
    wrong = measured.series(x, 1 + x, np.full(14, 1e-12), 1, (0, *range(2, 12)))[0]
    assert wrong.error > 1e-5
    assert str(measured.Measured(0.36815539, 2.2e-7)) == "0.3681554(2)"
    assert str(measured.Measured(1.0, 0.0099)) == "1.00(1)" and str(measured.Measured(1234.5, 20.0)) == "1234(20)"
    with pytest.raises(ValueError, match="Argument `x` must hold 4 values"):
        measured.series(x[:3], x[:3], x[:3], 2)


def test_a_crossing_has_the_error_of_the_quantity_over_its_slope():
    crossing = STUDIES.module("measured").crossing
    for sign in (1, -1):
        found = crossing(lambda x, sign=sign: (sign * x**2, 1e-6), 2 * sign, 1.0, 3.0, 1e-12)
        assert found.value == pytest.approx(math.sqrt(2), abs=2e-12)
        assert found.error == pytest.approx(1e-6 / (2 * math.sqrt(2)), rel=1e-4)
    assert crossing(lambda x: (x**2, 1e-6), 20.0, 1.0, 3.0, 1e-12) is None


@pytest.mark.slow
def test_the_tube_of_a_far_observer_is_as_wide_as_the_caustic_of_a_near_camera():
    section = STUDIES.module("far_camera.tube").section(0.9, 90.0, 25.0)
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
    settings = SETTINGS["far_camera"] | {"radii": far.RADII}
    far.main(tmp_path, **settings)
    for one in json.loads((tmp_path / "far_camera.json").read_text())["primary"]:
        for limit, theory in ((one["phi"][0], far.WIDTH), (one["theta"][0], far.WIDTH), (one["shift"][1], far.SHIFT)):
            assert abs(limit["value"] - theory) < 2 * limit["error"] < 1e-4
    near.main(tmp_path, **SETTINGS["inclination"])
    powers = {"theta_extent": 2, "phi_extent": 1, "caustic_area": 4}
    for law in json.loads((tmp_path / "inclination.json").read_text())["near_axis"]:
        miss = abs(law["power"]["value"] - powers[law["quantity"]])
        assert miss < 2 * law["power"]["error"] + 1e-3 and law["power"]["error"] < 0.2
