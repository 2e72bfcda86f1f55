"""The states that come with the package, for the page without a program: they are those of today's code."""

import time
from dataclasses import fields

import numpy as np
import pytest
from command_line import run
from exploring import read

from kerrcaustics.explorer import still_states
from kerrcaustics.explorer.answers import orbit_of
from kerrcaustics.explorer.lessons import LESSONS
from kerrcaustics.explorer.page_data import view_of
from kerrcaustics.explorer.state import ExplorerState
from kerrcaustics.explorer.still_states import CAMERAS, SHIPPED, THETAS

AGAIN = "Make them anew: python -m kerrcaustics.explorer.still_states"


@pytest.fixture(scope="module")
def kept():
    return still_states.read(SHIPPED)


def test_the_package_has_the_states_of_the_usual_page_and_no_others(kept):
    assert list(kept) == still_states.requests(CAMERAS, THETAS, LESSONS), AGAIN
    names = {field.name for field in fields(ExplorerState)}
    records = [read(data)[0] for data in kept.values()]
    assert all(set(record["state"]) == names for record in records), AGAIN
    assert all(record["kind"] == kind for record, (kind, _) in zip(records, kept, strict=True))


@pytest.mark.slow
def test_states_of_the_package_are_computed_alike_today(kept):
    """Within the reported errors, and the rounding of places to float32."""
    for (kind, state), data in list(kept.items())[:1] + list(kept.items())[7:8]:
        before, now = read(data), read((view_of if kind == "view" else _orbit)(state).encoded())
        assert list(before[0]) == list(now[0]) and before[0]["state"] == now[0]["state"], AGAIN
        for name, array in before[1].items():
            assert np.allclose(array, now[1][name], rtol=1e-5, atol=1e-5), f"{name} of {kind}: {AGAIN}"


def _orbit(state):
    return orbit_of(state, 240)


def test_a_state_that_is_not_kept_is_computed(tmp_path):
    state = ExplorerState(spin=0.3, orders=1)
    wanted = [("view", state)]
    assert wanted[0] not in still_states.read(SHIPPED)
    assert read(still_states.messages(wanted)["view", state])[0]["state"] == state.record()
    still_states.write(tmp_path / "states.xz", {("view", state): b"\nany bytes\n", ("orbit", state): b"more"})
    assert still_states.read(tmp_path / "states.xz") == {("view", state): b"\nany bytes\n", ("orbit", state): b"more"}


def test_the_standalone_page_is_written_at_once(capsys, tmp_path, monkeypatch):
    def refuse(*_):
        raise AssertionError("nothing is computed")

    monkeypatch.setattr("kerrcaustics.explorer.page_data.view_of", refuse)
    began = time.perf_counter()
    status, out, _ = run(capsys, "explore", "--page", tmp_path / "page.html")
    # Measured: 0.15 s, on a machine that others use.
    assert time.perf_counter() - began < 5
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert status == 0 and "page.html" in out and "<html" in text
    assert "http://" not in text.replace("http://www.w3.org", "")


@pytest.mark.slow
def test_the_demo_lays_the_page_beside_its_pictures(capsys, tmp_path):
    status, out, _ = run(capsys, "demo", "--output", tmp_path)
    assert status == 0 and (tmp_path / "explorer.html").stat().st_size > 1e6
    assert out.index(".png") < out.index("Drag a star") < out.index("explorer.html")
