"""`film --estimate`: how long a film would take, before anything of it is drawn."""

import json

import pytest
from command_line import run

from kerrcaustics.cli import film_estimate
from kerrcaustics.cli.film_estimate import time_of_frame

SCENE = """
[hole]
spin = 0.5
[camera.path]
kind = "expressions"
radius = "10 + 0.1 * t"
inclination_deg = 80
[view]
width = 160
height = 90
[sky]
kind = "checkerboard"
[film]
frames = 48
end = 4
"""


def test_times_grow_with_the_pixels_but_for_a_part_of_each_frame():
    # 2 s a frame, and 1e-4 s a pixel.
    assert time_of_frame([20_000, 80_000], [4.0, 10.0], 8_000_000) == pytest.approx(802.0)
    # A smaller frame that was slower, or all of whose time is one of pixels.
    assert time_of_frame([20_000, 80_000], [12.0, 8.0], 800_000) == pytest.approx(80.0)
    assert time_of_frame([20_000, 80_000], [1.0, 8.0], 800_000) == pytest.approx(80.0)
    assert time_of_frame([40_000], [3.0], 40_000) == 3.0


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """Sizes of the frames whose times are taken; they are those of a slow machine."""
    sizes = []

    def seconds(film, frame):
        height, width, _ = film.draw(frame).shape
        sizes.append((width, height))
        return 1.0 + width * height * 1e-5

    monkeypatch.setattr(film_estimate, "seconds_to_draw", seconds)
    monkeypatch.setattr(film_estimate, "SMALL", 1000)
    monkeypatch.setattr(film_estimate, "LARGE", 4000)
    (tmp_path / "scene.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    return sizes


def test_a_film_is_estimated_from_small_frames_and_nothing_is_written(drawn, capsys, tmp_path):
    status, out, err = run(capsys, "film", "scene.toml", "--estimate", "--quality", "draft", "--json", "e.json")
    assert status == 0, err
    record = json.loads((tmp_path / "e.json").read_text())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["e.json", "scene.toml"]
    assert record["frames"] == 48 and record["size"] == [160, 90]
    assert all(width * height < 5000 for width, height in drawn)
    low, high = record["seconds_per_frame"]
    assert low == pytest.approx(1.0 + 160 * 90 * 1e-5, rel=0.01) and high == pytest.approx(low)
    assert record["seconds"][0] == pytest.approx(48 * low)
    assert "A frame of 160 x 90 pixels: about" in out and "48 frames: about" in out


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--output", "x.mp4"], "--output must not be used with --estimate"),
        (["--scheduler", "tcp://host:1"], "--scheduler must not be used with --estimate"),
        (["--restart"], "--restart must not be used with --estimate"),
        (["--frames", "40:60"], "--frames must lie within 0:48"),
    ],
)
def test_what_an_estimate_cannot_use_is_refused(options, complaint, drawn, capsys):
    status, out, err = run(capsys, "film", "scene.toml", "--estimate", *options)
    assert (status, out) == (2, "") and complaint in err and err.count("\n") == 1


def test_scripts_have_no_estimate(capsys):
    status, _, err = run(capsys, "film", "pair_creation", "--estimate")
    assert status == 2 and "--estimate must be used with a scene" in err
