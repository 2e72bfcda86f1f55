"""Commands with an observer in place of a camera: at infinity, and at a finite radius with --observer."""

import json
import math
from functools import partial

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.draw import orbit_films

PLACE = ("--spin", 0.9, "--inclination", 60)
NEAR = (*PLACE, "--radius", 200, "--observer")
FAR = (*PLACE, "--radius", "inf")
OBSERVER = kc.Observer(spin=0.9, inclination=math.radians(60), radius=200.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("images", "--radius", 200, "--star", 70, 120, "--velocity", "circular"),
            "--velocity must be fiducial with --observer",
        ),
        (
            ("counts", "--radius", 200, "--star", 70, 120, "--velocity", "static"),
            "--velocity must be fiducial with --observer",
        ),
        (("images", "--star", 70, 120, "--radius", 1.1), "--radius must be larger than the horizon radius"),
        (("tracks", "--star-theta", 70, "--radius", 1e10), "--radius must be at most 1e+09"),
    ],
    ids=str,
)
def test_observers_that_cannot_be_are_refused_in_one_line(arguments, message, capsys):
    command, *others = arguments
    status, out, err = run(capsys, command, *PLACE, "--observer", *others)
    assert (status, out) == (2, "") and err.startswith(f"kerrcaustics: Argument {message}") and err.count("\n") == 1


@pytest.mark.slow
def test_an_observer_at_a_finite_radius(capsys, tmp_path):
    file = tmp_path / "images.json"
    status, out, _ = run(capsys, "images", *NEAR, "--star", 70, 120, "--json", file)
    assert status == 0 and "r = 200, inclination 60 deg, fiducial observer" in out and "alpha, beta" in out
    entry, images = json.loads(file.read_text()), kc.star_images(OBSERVER, (math.radians(70), math.radians(120)))
    assert (entry["viewer"], entry["radius"], entry["certified"]) == ("observer", 200, True)
    rows = entry["images"]
    np.testing.assert_array_equal([row["sky"] for row in rows], images.sky)
    assert [row["error"] for row in rows] == images.error.tolist() and "error_rad" not in rows[0]
    assert [row["time"] for row in rows] == images.time.tolist()
    # A camera there sees the same, at angles.
    status, _, _ = run(capsys, "images", *PLACE, "--radius", 200, "--star", 70, 120, "--json", file)
    entry = json.loads(file.read_text())
    assert "viewer" not in entry and "error_rad" in entry["images"][0]
    assert [row["index"] for row in entry["images"]] == images.index.tolist()


@pytest.mark.slow
def test_counts_of_observers(capsys, tmp_path):
    file = tmp_path / "counts.json"
    status, out, _ = run(capsys, "counts", *NEAR, "--circle", 60, -30, "--line", 40, "--json", file, "--points")
    entry = json.loads(file.read_text())
    assert status == 0 and entry["certified"] and entry["remarks"] == []
    curve = entry["curves"][0]
    assert len(curve["time"]) == len(curve["time_error"]) == len(curve["sky"]) and "error" in curve
    crossing = entry["line"]["crossings"][0]
    assert len(crossing["sky"]) == 2 and crossing["time_error"] < 1e-9
    status, out, _ = run(capsys, "counts", *FAR, "--circle", 60, -30, "--line", 40, "--json", file)
    assert status == 0 and json.loads(file.read_text())["radius"] is None
    status, out, _ = run(capsys, "counts", *FAR, "--map", "--rows", 10, "--json", file)
    entry = json.loads(file.read_text())
    assert status == 0 and "at infinite (alpha, beta)" in out and "at infinite (alpha, beta)" in entry["remarks"][0]


@pytest.mark.slow
@pytest.mark.parametrize("place", [NEAR, FAR], ids=["finite", "infinity"])
def test_pictures_and_films_of_observers(place, capsys, tmp_path, monkeypatch):
    picture = tmp_path / "caustics.png"
    status, _, _ = run(capsys, "caustics", *place, "--figure", picture)
    assert status == 0 and picture.read_bytes()[:4] == b"\x89PNG"
    monkeypatch.setattr(orbit_films, "orbit_film", partial(orbit_films.orbit_film, frames=6))
    star = ("--star-theta", 60, "--max-index", 1)
    figure, film, file = (tmp_path / name for name in ("tracks.png", "tracks.gif", "tracks.json"))
    arguments = ("--figure", figure, "--film", film, "--json", file)
    status, out, _ = run(capsys, "tracks", *place, *star, *arguments)
    assert status == 0 and "in one turn of phi': certified" in out
    assert figure.read_bytes()[:4] == b"\x89PNG" and film.read_bytes()[:3] == b"GIF"
    entry = json.loads(file.read_text())
    assert entry["period"] is None and entry["angular_velocity"] == 0
    events = entry["events"] + entry["ends"]
    assert events and all(event["moment"] is None and event["time_error"] < 1e-8 for event in events)
