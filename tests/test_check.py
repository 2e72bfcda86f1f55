"""Automated checks of caustics and image counts from a file."""

import json
import math
import re

import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.report.checks import (
    CausticCheck,
    CheckFile,
    StarCheck,
    StoredCheck,
    caustic_outcome,
    outcomes,
    read_checks,
    value_and_error,
)
from kerrcaustics.scripts import HOME

PAPER = {"spin": 0.999, "radius": 6.03}


def only(check, folder="."):
    (found,) = outcomes(CheckFile(**{type(check).__name__.removesuffix("Check").lower(): [check]}), folder)
    return found


def test_the_template_is_met(capsys, tmp_path):
    status, text, _ = run(capsys, "check", "--template")
    assert status == 0
    file = tmp_path / "checks.toml"
    file.write_text(text)
    status, out, err = run(capsys, "check", str(file), "--json", str(tmp_path / "out.json"))
    assert (status, err) == (0, "")
    assert out.count("\nok") + out.startswith("ok") == 2 and "2 checks, all met" in out
    record = json.loads((tmp_path / "out.json").read_text())
    assert record["schema"] == "kerrcaustics/check/1" and record["met"] is True
    assert [entry["met"] for entry in record["checks"]] == [True, True]


def test_figures_of_the_paper_are_met():
    """No spin; circuits and widths of the caustics; images inside and outside."""
    checks = read_checks(HOME / "studies" / "checks" / "paper_figures.toml")
    assert len(checks.caustic) >= 7 and len(checks.star) >= 6
    assert [found.faults for found in outcomes(checks)] == [()] * (len(checks.caustic) + len(checks.star))


def test_ranges_of_that_file_are_those_of_another_program():
    """All of them at r = 6.03: each holds the stored number, and little else."""
    cases = json.loads((HOME / "tests" / "data" / "caustics.json").read_text())
    known = {one["order"]: one for case in cases if (case["a"], case["r_c"]) == (0.999, 6.03) for one in case["orders"]}
    names = {"theta_min": "theta_min", "theta_max": "theta_max", "phi_extent": "phi_extent_deg"}
    checks = read_checks(HOME / "studies" / "checks" / "paper_figures.toml").caustic
    far = [check for check in checks if check.radius == PAPER["radius"]]
    assert [check.order for check in far] == [1, 2, 3]
    for check in far:
        for name, key in names.items():
            low, high = getattr(check, name)
            assert low < known[check.order][key] < high < low + 1e-6, (check.name, name)


def test_an_observer_at_infinity_is_checked_too():
    assert only(CausticCheck(spin=0.9, radius=math.inf, inclination=60.0, order=2)).met


def test_the_example_of_the_page_prints_what_the_page_shows(capsys, tmp_path):
    page = (HOME / "docs" / "studies.md").read_text(encoding="utf-8").partition("## Checks in other projects")[2]
    (file, printed) = (re.search(rf"```{kind}\n(.*?)```", page, re.DOTALL)[1] for kind in ("toml", "text"))
    (tmp_path / "checks.toml").write_text(file)
    assert run(capsys, "check", str(tmp_path / "checks.toml")) == (0, printed, "")


def test_a_study_takes_an_outcome_from_caustics_that_it_has():
    """As the studies astroids and spin_radius do."""
    curves = kc.caustics(kc.Camera(0.9, 10.0, velocity="fiducial"), 1)
    check = CausticCheck(spin=0.9, radius=10.0, order=1, cusps=4)
    assert caustic_outcome(check, curves) == only(check)
    circuits, error = value_and_error(curves[0], "circuits")
    assert circuits == curves[0].circuits and error == pytest.approx(curves[0].error / math.pi)
    assert caustic_outcome(CausticCheck(spin=0.9, radius=10.0, order=2), curves).faults == ("it was not found",)


@pytest.mark.parametrize(
    ("asked", "fault"),
    [
        ({"kind": "point"}, "it is astroid, and must be point"),
        ({"closed": False}, "its ends meet"),
        ({"cusps": 3}, "it has 4 cusps, and must have 3"),
        ({"circuits": (0.8, 0.9)}, "circuits is 0.7306"),
        ({"theta_min": (50.0, 54.0)}, "theta_min is 54.08"),
        ({"theta_max": (126.0, 130.0)}, "outside [126, 130]"),
        ({"phi_extent": (0.0, 10.0)}, "outside [0, 10]"),
    ],
)
def test_what_a_caustic_is_not_is_said(asked, fault):
    found = only(CausticCheck(**PAPER, order=2, **asked))
    assert not found.met and any(fault in line for line in found.faults), found
    assert found.line.startswith("FAIL caustic 2 at a = 0.999")


def test_a_range_that_ends_within_the_error_decides_nothing():
    curve = kc.caustics(kc.Camera(0.999, 6.03, velocity="fiducial"), 2)[1]
    value = math.degrees(curve.theta_extent)
    assert only(CausticCheck(**PAPER, order=2, theta_extent=(value - 1e-6, value + 1e-6))).met
    found = only(CausticCheck(**PAPER, order=2, theta_extent=(value, value + 1)))
    assert not found.met and "decides nothing about" in found.faults[0]


def test_a_caustic_seen_from_the_equator_lies_evenly_about_it():
    # By symmetry theta_max is 180 degrees less theta_min, each with its own error.
    curve = kc.caustics(kc.Camera(0.999, 6.03, velocity="fiducial"), 2)[1]
    low, wide = math.degrees(curve.theta_min), math.degrees(3 * curve.error)
    ranges = {"theta_min": (low - wide, low + wide), "theta_max": (180 - low - wide, 180 - low + wide)}
    assert only(CausticCheck(**PAPER, order=2, **ranges)).faults == ()
    # An extreme has the error of the curve, an extent twice as much.
    margin = math.degrees(1.5 * curve.error)
    assert only(CausticCheck(**PAPER, order=2, theta_min=(low - margin, low + margin))).met
    extent = math.degrees(curve.theta_extent)
    assert not only(CausticCheck(**PAPER, order=2, theta_extent=(extent - margin, extent + margin))).met


def test_counts_of_a_star():
    assert only(StarCheck(**PAPER, star=(84.0, 60.0), counts=[1, 1, 5])).met
    found = only(StarCheck(**PAPER, star=(84.0, 60.0), counts=[1, 1, 3]))
    assert found.faults == ("it has 1 + 1 + 5 images of index 0 to 2, and must have 1 + 1 + 3 images of index 0 to 2",)
    # On the point caustic of a hole without spin nothing is certified.
    ring = only(StarCheck(spin=0.0, radius=10.0, star=(90.0, 180.0), counts=[0, 0]))
    assert not ring.met and any("one ring" in fault for fault in ring.faults)


def test_stored_results_are_found_again(tmp_path):
    camera = kc.Camera(0.9, 10.0)
    caustics, images = kc.caustics(camera, 2), kc.star_images(camera, (1.4, 2.9), max_index=1)
    kc.save(tmp_path / "caustics.npz", caustics)
    kc.save(tmp_path / "images.npz", images)
    kc.save(tmp_path / "camera.npz", camera)
    assert only(StoredCheck(file="caustics.npz"), tmp_path).met
    assert only(StoredCheck(file="images.npz"), tmp_path).met
    assert "must hold CausticSet or StarImages" in only(StoredCheck(file="camera.npz"), tmp_path).faults[0]
    (tmp_path / "broken.npz").write_text("no result")
    assert not only(StoredCheck(file="broken.npz"), tmp_path).met


def test_a_stored_result_that_changed_is_a_fault(tmp_path):
    camera = kc.Camera(0.9, 10.0)
    # Those of another star under this one's name stand for results of an older version that was wrong.
    images = kc.star_images(camera, (1.4, 2.9), max_index=1)
    object.__setattr__(images, "star", (1.4 + 1e-9, 2.9))
    kc.save(tmp_path / "moved.npz", images)
    found = only(StoredCheck(file="moved.npz"), tmp_path)
    assert not found.met and all("more than both errors" in fault for fault in found.faults)
    caustics = kc.caustics(camera, 1)
    object.__setattr__(caustics[0], "phi_max", caustics[0].phi_max + 1e-9)
    kc.save(tmp_path / "wider.npz", caustics)
    assert "phi_max differs by 1.0e-09 rad" in only(StoredCheck(file="wider.npz"), tmp_path).faults[0]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "without any"),
        ("[[caustic]]\nspin = 0.9\nradius = 10", "`order`"),
        ("[[caustic]]\nspin = 1.5\nradius = 10\norder = 1", "spin"),
        ("[[caustic]]\nspin = 0.9\nradius = 10\norder = 11", "from 1 to 10"),
        ("[[caustic]]\nspin = 0.9\nradius = 10\norder = 1\ncircuits = [2, 1]", "the least and the largest value"),
        ("[[caustic]]\nspin = 0.9\nradius = 10\norder = 1\ntheta_max = [91, 90]", "theta_max must be the least and"),
        ("[[star]]\nspin = 0.9\nradius = 10\nstar = [84, 60]\ncounts = []", "a list of 1 to 7 numbers"),
        ("[[star]]\nspin = 0.9\nradius = 10\nstar = [200, 60]\ncounts = [1]", "theta' in [0, 180]"),
        ("[[star]]\nspin = 0.9\nradius = 10\nstar = [84, 60]\ncounts = [1]\nvelocity = 'static'", "velocity"),
        ("[[stored]]\nfile = 'none.npz'", "the name of a file"),
    ],
)
def test_a_file_that_asks_for_what_cannot_be_is_refused_in_one_line(text, complaint, capsys, tmp_path):
    file = tmp_path / "checks.toml"
    file.write_text(text)
    status, out, err = run(capsys, "check", str(file))
    assert (status, out) == (2, "") and err.count("\n") == 1 and complaint in err, err
    with pytest.raises(ValueError, match=r"Check file|hole"):
        read_checks(file)


def test_without_a_file_or_with_both_the_way_out_is_named(capsys, tmp_path):
    status, _, err = run(capsys, "check")
    assert status == 2 and "FILE must be given" in err
    status, _, err = run(capsys, "check", "x.toml", "--template")
    assert status == 2 and "--template must be used alone" in err


def test_status_1_tells_how_many_failed(capsys, tmp_path):
    file = tmp_path / "checks.toml"
    file.write_text("[[star]]\nspin = 0.9\nradius = 10\nstar = [84, 60]\ncounts = [7]\n")
    status, out, err = run(capsys, "check", str(file))
    assert status == 1 and out.startswith("FAIL star 84 60") and "1 of 1 checks failed." in err
