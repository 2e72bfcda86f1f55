"""Text files of Windows programs, which begin with a byte-order mark, are read like those without."""

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.scene_files.orbit_file import read_orbit

MARK = "\ufeff"
SCENE = """hole = {spin = 0.9}
camera = {path = {kind = "csv", file = "way.csv"}, velocity = "fiducial"}
sky = {kind = "checkerboard"}
"""
WAY = "time,radius,inclination_deg,azimuth_deg\n0,20,80,0\n9,15,90,10\n"
CURVES = "450 1 0 0\n550 0 1 0\n650 0 0 1\n"


@pytest.mark.parametrize("mark", ["", MARK])
def test_scenes_and_their_paths(tmp_path, mark):
    (tmp_path / "scene.toml").write_text(mark + SCENE, encoding="utf-8")
    (tmp_path / "way.csv").write_text(mark + WAY, encoding="utf-8")
    assert kc.SceneFile.read(tmp_path / "scene.toml").camera(9.0).radius == 15


@pytest.mark.parametrize("mark", ["", MARK])
def test_measured_responses_keep_their_first_row(tmp_path, mark):
    (tmp_path / "curves.txt").write_text(mark + CURVES, encoding="utf-8")
    assert np.array_equal(kc.pictures.MeasuredResponse.read(tmp_path / "curves.txt").wavelengths, [450, 550, 650])


@pytest.mark.parametrize("mark", ["", MARK])
def test_orbits(tmp_path, mark):
    (tmp_path / "orbit.toml").write_text(mark + 'kind = "kepler"\nsemi_major_axis = 100.0\n', encoding="utf-8")
    assert "semi_major_axis=100.0" in repr(read_orbit(tmp_path / "orbit.toml"))


@pytest.mark.parametrize("mark", ["", MARK])
def test_lists_of_stars(tmp_path, mark, capsys):
    """The star in the first line is bad, and named."""
    (tmp_path / "stars.csv").write_text(mark + "200,10\n80,10\n", encoding="utf-8")
    status, _, err = run(capsys, "counts", "--spin", 0.9, "--radius", 10, "--stars", tmp_path / "stars.csv")
    assert status == 2 and "--stars, line 1," in err and "[0, 180] degrees" in err
