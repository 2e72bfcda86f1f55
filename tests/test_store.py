"""Caustics as files, records and Datasets: nothing is lost, nothing half-written."""

import copy
import json
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.files import writing


@pytest.fixture(scope="module", params=["astroids", "point", "moving"])
def caustics(request):
    camera = {
        "astroids": kc.Camera(0.9, 6.0, math.radians(60)),
        "point": kc.Camera(0.0, 6.0),
        "moving": kc.Camera(0.5, 4.0, 1.0, (0.1, -0.2, 0.3)),
    }[request.param]
    return kc.caustics(camera, 2)


def test_loads_back_equal(caustics, tmp_path):
    path = tmp_path / "caustics.npz"
    kc.save(path, caustics)
    loaded = kc.load(path)
    assert loaded == caustics
    assert loaded.camera == caustics.camera and loaded.versions == caustics.versions
    assert [f.name for f in tmp_path.iterdir()] == ["caustics.npz"]


def test_equality_sees_a_change_of_one_number(caustics, tmp_path):
    changed = copy.deepcopy(caustics)
    assert (changed == caustics, changed != caustics) == (True, False)
    changed[0].sky[0, 0] = np.nextafter(changed[0].sky[0, 0], 2)
    assert (changed == caustics, changed != caustics) == (False, True)


def test_equality_sees_another_camera(caustics):
    changed = replace(caustics, camera=kc.Camera(0.1, 20.0))
    assert (changed == caustics, changed != caustics) == (False, True)


def test_a_set_is_a_sequence(caustics):
    first, second = caustics
    assert (caustics[0], caustics[-1], caustics[:2], len(caustics)) == (first, second, (first, second), 2)
    assert first in caustics and list(reversed(caustics)) == [second, first] and [*caustics] == [first, second]


def test_travels_between_processes(caustics):
    assert pickle.loads(pickle.dumps(caustics)) == caustics


def test_record_follows_the_schema(caustics):
    text = json.dumps(kc.record(caustics, points=True), allow_nan=False)
    entry = json.loads(text)
    assert entry["schema"] == "kerrcaustics/caustics/2"
    assert {"spin", "radius", "inclination_deg", "velocity", "engine", "seconds", "beams", "curves"} <= entry.keys()
    for found, curve in zip(entry["curves"], caustics, strict=True):
        assert found["phi_extent_deg"] == pytest.approx(math.degrees(curve.phi_extent), abs=1e-12)
        assert found["theta_max_deg"] - found["theta_min_deg"] == pytest.approx(found["theta_extent_deg"], abs=1e-12)
        assert found["circuits"] == pytest.approx(found["phi_extent_deg"] / 360)
        assert len(found["sky"]) == len(found["celestial_deg"]) == len(curve.sky)
        assert [len(c["sky"]) for c in found["cusps"]] == [3] * len(curve.cusps)
        assert found["error_deg"] == pytest.approx(math.degrees(curve.error))
    assert "sky" not in kc.record(caustics)["curves"][0]


def test_degrees_come_back_as_they_went_in():
    for degrees in (90.0, 60.0, 30.0, 17.0, 89.9):
        camera = kc.Camera(0.0, 9.0, math.radians(degrees))
        assert kc.record(kc.caustics(camera, 1))["inclination_deg"] == degrees


def test_dataset_holds_curves_and_cusps(caustics):
    data = kc.to_xarray(caustics)
    for curve in caustics:
        here = data.sel(order=curve.order)
        np.testing.assert_array_equal(here.place.values[: len(curve.celestial)], curve.celestial)
        assert np.isnan(here.place.values[len(curve.celestial) :]).all()
        assert float(here.error) == curve.error
        for cusp, stored in zip(curve.cusps, here.cusp.values, strict=False):
            np.testing.assert_array_equal(stored, cusp.celestial)
    assert data.attrs["spin"] == caustics.camera.spin and data.place.attrs["units"] == "rad"


def test_an_empty_set_becomes_an_empty_dataset(caustics):
    empty = replace(caustics, curves=(), missing=(1,))
    assert kc.to_xarray(empty).sizes["order"] == 0


def test_an_interrupted_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "numbers"
    path.write_bytes(b"old")
    with pytest.raises(KeyboardInterrupt), writing(path) as file:
        file.write(b"half of the new")
        raise KeyboardInterrupt
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
