"""The command `tracks`, its record and its pictures."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from command_line import run
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.brightness import brightness
from kerrcaustics.draw.tracks import tracks_on_sky
from kerrcaustics.results.records import record

PLACE = ("--spin", 0.9, "--radius", 6)
STAR = ("--star-theta", 70, "--max-index", 1)
CAMERA = kc.Camera(0.9, 6.0)


@pytest.fixture(scope="module")
def tracks():
    return kc.star_tracks(CAMERA, math.radians(70), 1)


def test_tracks_command(capsys, tmp_path, tracks):
    target, picture = tmp_path / "out.json", tmp_path / "tracks.png"
    status, out, err = run(capsys, "tracks", *PLACE, *STAR, "--json", target, "--figure", picture)
    assert (status, err) == (0, "")
    assert "2 tracks, 2 events" in out and ": certified" in out and "turns" in out
    assert out.endswith(f"Figure: {picture}\n")
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.json", "tracks.png"]
    entry = json.loads(target.read_text())
    assert entry["schema"] == "kerrcaustics/tracks/1" and entry["certified"] and entry["seconds"] > 0
    assert (entry["star_theta_deg"], entry["max_index"], entry["engine"]) == (70, 1, "auto")
    assert (entry["spin"], entry["radius"], entry["inclination_deg"], entry["velocity"]) == (0.9, 6, 90, "circular")
    assert entry["period"] == tracks.period
    assert entry["tracks"] == record(tracks)["tracks"]
    for one, track in zip(entry["tracks"], tracks.tracks, strict=True):
        columns = {"sky", "phi_deg", "index", "parity", "magnification", "redshift", "time", "error_rad"}
        columns |= {f"{name}_error" for name in ("magnification", "redshift", "time")}
        assert set(one) == columns | {"closed", "turns", "event_points"}
        assert {len(one[name]) for name in columns} == {len(track)}
        assert one["sky"] == track.sky.tolist() and one["event_points"] == list(track.places)
        assert [value is None for value in one["magnification"]] == (track.parity == 0).tolist()
    assert len(entry["ends"]) == len(tracks.ends) > 0
    for one, event in zip(entry["ends"], tracks.ends, strict=True):
        assert (one["kind"], one["order"], one["indices"]) == (event.kind, 2, [1, 2])
        assert one["phi_unwrapped_deg"] == math.degrees(event.azimuth) and one["star_deg"][0] == pytest.approx(70)
        # At time 0 the star's azimuth is the camera's.
        phase = one["phi_unwrapped_deg"] + math.degrees(entry["angular_velocity"]) * one["moment"]
        assert abs((phase + 180) % 360 - 180) < 1e-7
        assert one["sky"] == event.sky.tolist() and one["error_rad"] == event.error


def test_tracks_from_a_file_are_those_that_were_saved(tmp_path, tracks):
    kc.save(tmp_path / "tracks.npz", tracks)
    loaded = kc.load(tmp_path / "tracks.npz")
    assert loaded == tracks and repr(loaded) == repr(tracks)
    for one, other in zip(loaded.images_at([0.0, 3.0]), tracks.images_at([0.0, 3.0]), strict=True):
        assert one.certified and one.per_index == other.per_index
        assert (np.linalg.norm(one.sky - other.sky, axis=1) <= one.error + other.error).all()


def test_pictures_show_every_track_in_the_colour_of_its_index(tracks):
    caustics, edge = kc.caustics(CAMERA, 2), kc.shadow_edge(CAMERA, 400)
    ax = tracks_on_sky(Figure().add_subplot(), tracks, caustics, edge)
    colours = {line.get_color() for line in ax.lines if line.get_linestyle() == "-"}
    assert colours == {style.index_colour(0), style.index_colour(1)}
    assert [line.get_marker() for line in ax.lines].count("^") == 1
    # Lines of a track leave out no point.
    drawn = sum(len(line.get_xdata()) for line in ax.lines if line.get_linestyle() == "-")
    assert drawn >= sum(map(len, tracks.tracks))


def test_brightness_is_that_of_the_images(tracks):
    event = tracks.ends[0]
    ax = brightness(Figure().add_subplot(), tracks, event.moment - 2, event.moment + 2)
    lines = [line for line in ax.lines if len(line.get_xdata()) > 10]
    counts = np.array([0, 0])
    for line in lines:
        times, light = line.get_xydata().T
        assert np.isfinite(light).all()
        counts[int(times[0] > event.moment)] += 1
        for i in (3, 50, 96):
            assert np.abs(tracks.images_at(times[i]).magnification / light[i] - 1).min() < 1e-9
    # The pair has one image of index 1; the other has index 2, and is not asked for.
    assert counts[1] - counts[0] == (1 if event.kind == "creation" else -1)


def test_one_moment_too_close_to_an_event_leaves_out_no_image(tracks, monkeypatch):
    event = tracks.ends[0]
    span = event.moment + 1, event.moment + 2
    expected = brightness(Figure().add_subplot(), tracks, *span)
    true = type(tracks).images_at

    def with_one_twice(self, times):
        images = true(self, times)
        first = images[0]
        again = {name: np.concatenate([getattr(first, name)] * 2) for name in ("sky", "index", "magnification")}
        double = replace(first, **again, per_index={k: 2 * n for k, n in first.per_index.items()})
        return (double, *images[1:])

    monkeypatch.setattr(type(tracks), "images_at", with_one_twice)
    shown = brightness(Figure().add_subplot(), tracks, *span)
    assert len(shown.lines) == len(expected.lines) >= 2
    for line, other in zip(shown.lines, expected.lines, strict=True):
        assert np.array_equal(np.sort(line.get_ydata()[1:]), np.sort(other.get_ydata()[1:]))


BAD = [
    (PLACE, "--star-theta"),
    ((*PLACE, "--star-theta", 181), "--star-theta must lie in [0, 180] degrees, but is 181."),
    ((*PLACE, "--star-theta", -1), "--star-theta must lie in [0, 180] degrees, but is -1."),
    ((*PLACE, "--star-theta", "nan"), "--star-theta must lie in [0, 180] degrees, but is nan."),
    ((*PLACE, "--star-theta", 70, "--max-index", -1), "--max-index must be a whole number from 0 to 6"),
    ((*PLACE, "--star-theta", 70, "--max-index", 1.5), "--max-index must be a whole number, but is 1.5."),
    ((*PLACE, "--star-theta", 70, "--velocity", "static"), "--velocity must make the camera orbit the spin axis"),
    ((*PLACE, "--star-theta", 70, "--inclination", 0), "--velocity must make the camera orbit the spin axis"),
    ((*PLACE, "--star-theta", 70, "--figure", "x.jpg"), "--figure must end in .png, .pdf, .svg"),
    ((*PLACE, "--star-theta", 70, "--json", "no/x.json"), "--json must name a file in a folder that exists"),
]


@pytest.mark.parametrize(("arguments", "complaint"), BAD, ids=lambda value: " ".join(map(str, value))[:70])
def test_bad_input_gets_one_line_and_exit_status_2(arguments, complaint, assert_refused):
    assert_refused(("tracks", *arguments), complaint)
