"""The seconds of each stage."""

import pytest

import kerrcaustics as kc
from kerrcaustics.results.stages import in_words, stage, stages_timed


def test_stages_are_timed_by_name_and_reported(monkeypatch):
    now, reported = [0.0], []
    monkeypatch.setattr("kerrcaustics.results.stages.clock", lambda: now[0])

    def work(seconds):
        now[0] += seconds

    with stages_timed(lambda name, before: reported.append((name, list(before)))) as outer:
        for _ in range(2):
            with stage("map"):
                work(2)
        with stages_timed() as inner, stage("light"):
            work(3)
            stage("stars")(work)(5)
            work(1)
    with stage("unheard"):
        work(7)
    assert reported == [("map", []), ("map", ["map"]), ("light", ["map"]), ("stars", ["map"])]
    # A stage within another one is taken off it.
    assert inner == {"stars": 5, "light": 4} and outer == {"map": 4, **inner}
    assert in_words({"sky_map": 1.24, "stars": 0.06}) == "sky map 1.2 s, stars 0.1 s"


def test_what_fails_is_timed_too():
    with stages_timed() as seconds, pytest.raises(ZeroDivisionError), stage("map"):
        raise ZeroDivisionError
    with stage("later"):
        pass
    assert seconds.keys() == {"map"}


@pytest.mark.slow
def test_stages_of_a_rendering_add_up_to_its_time(tmp_path):
    camera = kc.Camera(0.6, 20.0)
    view, disk = kc.pictures.View.toward_hole(camera, 64, 48, 1.5), kc.disks.Disk(6, 12, kc.disks.BlackBody(5000))
    traced = kc.pictures.trace_view(camera, view, disk=disk)
    assert traced.stages.keys() == {"disk_map", "sky_map", "shadow_edge"}
    seen = traced.show(kc.skies.StarField(), disk=disk)
    assert seen.stages.keys() == traced.stages.keys() | {"sky_light", "stars", "disk_light"}
    assert 0.9 * seen.seconds < sum(seen.stages.values()) <= seen.seconds
    kc.save(tmp_path / "seen.npz", seen)
    assert kc.load(tmp_path / "seen.npz") == seen
    assert kc.record(seen)["stages"] == seen.stages and kc.to_xarray(seen).attrs["stage_stars"] == seen.stages["stars"]
