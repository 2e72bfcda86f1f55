"""The command `rings`: its numbers are those of Python, and options that nothing would use are refused in one line."""

import csv
import json
import math

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc

PLACE = ("--spin", 0.94, "--radius", "inf", "--inclination", 17)
SCALE = ("--mass", 6.2e9, "--distance", 16.9e6)
NEAR = ("--spin", 0.9, "--radius", 6, "--inclination", 60)


def test_numbers_are_those_of_python(capsys):
    status, out, err = run(capsys, "rings", *PLACE, "--max-order", 2, "--inner", "isco", "--outer", 20, "--json", "-")
    entry = json.loads(out)
    rings = kc.photon_rings(kc.Observer(spin=0.94, inclination=math.radians(17)), max_order=2, inner="isco", outer=20.0)
    assert status == 0 and entry["schema"] == "kerrcaustics/photon-rings/1" and entry["certified"]
    assert [band["solid_angle"] for band in entry["bands"]] == [band.solid_angle for band in rings]
    assert entry["inner"] == kc.isco(0.94) and entry["spin"] == 0.94 and "visibilities" not in entry
    assert "gamma 2.36" in err and "3 bands: certified" in err


def test_an_infinite_area_is_null_and_cameras_have_bands(capsys):
    _, out, _ = run(capsys, "rings", *PLACE, "--max-order", 0, "--json", "-", "--points")
    entry = json.loads(out)
    assert entry["bands"][0]["solid_angle"] is None and len(entry["bands"][0]["rims"]) == 1
    assert len(entry["edge"]["lyapunov"]) == len(entry["bands"][0]["rims"][0]["sky"])
    status, out, _ = run(capsys, "rings", "--spin", 0.9, "--radius", 6, "--max-order", 1, "--json", "-")
    assert status == 0 and json.loads(out)["inclination_deg"] == 60


@pytest.mark.parametrize("ending", ["csv", "fits"])
def test_tables_hold_visibilities(ending, tmp_path, capsys):
    if ending == "fits":
        fits = pytest.importorskip("astropy.io.fits")
    table = tmp_path / f"rings.{ending}"
    options = ("--max-order", 1, "--baselines", "0:20:5", "--angle", 30, "--position-angle", 10, "--table", table)
    status, _, err = run(capsys, "rings", *PLACE, *SCALE, *options)
    rings = kc.photon_rings(kc.Observer(spin=0.94, inclination=math.radians(17)), max_order=1)
    length = np.linspace(0, 20, 5)
    u, v = length * math.sin(math.radians(30)), length * math.cos(math.radians(30))
    scale = kc.PhysicalScale(6.2e9, 16.9e6)
    seen = kc.ring_visibility(rings, u, v, scale=scale, position_angle=math.radians(10))
    assert status == 0 and "20 giga-wavelengths" in err + _
    if ending == "csv":
        rows = list(csv.DictReader(table.open()))
        found = [complex(float(row["real"]), float(row["imaginary"])) for row in rows]
    else:
        with fits.open(table) as units:
            found = units[1].data["real"] + 1j * units[1].data["imaginary"]
    np.testing.assert_allclose(found, seen.value.ravel(), atol=1e-12)


def test_figures_and_files_are_written(tmp_path, capsys):
    figure, saved = tmp_path / "rings.png", tmp_path / "rings.npz"
    options = ("--max-order", 1, "--figure", figure, "--save", saved)
    assert run(capsys, "rings", *NEAR, *options)[0] == 0
    assert figure.stat().st_size > 10_000 and kc.load(saved)[1].certified
    options = ("--max-order", 1, "--baselines", "0.1:3:40", "--figure", figure)
    assert run(capsys, "rings", *PLACE, *options)[0] == 0


REFUSED = [
    (("--angle", 10), "--angle must be used with --baselines"),
    (("--position-angle", 10), "--position-angle must be used with --baselines"),
    (("--table", "v.csv"), "--table must be used with --baselines"),
    (("--mass", 6e9), "--mass must be used with --baselines"),
    (("--mass", 6e9, "--baselines", 3), "--mass must be used with --distance"),
    (("--baselines", "1:x"), "--baselines must be a number or LOW:HIGH:COUNT, but is 1:x"),
    (("--baselines", "5:1"), "--baselines must be LOW:HIGH:COUNT with 0 <= LOW < HIGH"),
    (("--baselines", "1:5:2.5"), "--baselines must be LOW:HIGH:COUNT"),
    (("--baselines", "1e6"), "--baselines must make shorter baselines: one of 1e+06 cycles per M needs"),
    (("--inner", "rim"), "--inner must be a radius or isco, but is rim"),
    (("--inner", 1.0), "--inner must be finite and larger than the horizon radius"),
    (("--outer", 1.0), "--outer must be larger than the inner radius"),
    (("--max-order", 10), "--max-order must be a whole number from 0 to 9, but is 10"),
    (("--points",), "--points must be used with --json"),
    (("--baselines", 3, "--max-order", 0), "--outer must be finite, or --max-order at least 1"),
]


@pytest.mark.parametrize(("options", "line"), REFUSED, ids=str)
def test_refusals_are_one_line(options, line, capsys):
    status, out, err = run(capsys, "rings", *PLACE, *options)
    assert (status, out) == (2, "") and line in err and err.count("\n") == 1


def test_cameras_measure_no_baselines(capsys):
    status, _, err = run(capsys, "rings", *NEAR, "--baselines", 3)
    assert status == 2 and "--baselines must be used with --observer or --radius inf" in err
