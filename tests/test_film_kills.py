"""Films whose processes are killed, and films on other processes: slow."""

import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from filming import MovingBar
from killing import GUARD, dask, kill_at_random, scheduler, told, workers_of

from kerrcaustics.films.film import frames_folder, make_film
from kerrcaustics.films.scene_films import scene_film

FRAMES = 80
PROGRAM = Path(__file__).parent / "quick_film.py"


def started(scene, target, *arguments, **settings):
    command = [sys.executable, PROGRAM, "film", scene, "--output", target, *arguments]
    output = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(list(map(str, command)), **output, **settings)


def frames_done(target):
    return len(list(frames_folder(target).glob("*.png")))


def wait_for_more(process, target):
    before = frames_done(target)
    while process.poll() is None and frames_done(target) == before:
        time.sleep(0.005)


def check_finished(process, target, good):
    """The film is there, and is the same; nothing that a process says about itself."""
    out, _ = process.communicate(timeout=GUARD)
    assert process.returncode == 0 and out.splitlines()[-1] == f"Film: {target}", out
    # But for lines about its progress.
    assert all("frames" in line for line in out.splitlines()[:-1]), out
    assert target.read_bytes() == good
    assert not [file.name for file in target.parent.iterdir() if file.name.startswith(".")]


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """The bytes of the film that nobody disturbs, drawn in this process."""
    path = tmp_path_factory.mktemp("good") / "good.mp4"
    make_film(path, scene_film(MovingBar(FRAMES)))
    return path.read_bytes()


@pytest.fixture
def scene(tmp_path):
    folder = tmp_path / "scenes"
    folder.mkdir()
    path = folder / "bar.toml"
    path.write_text(json.dumps({"frames": FRAMES, "pause": 0.08}))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [(), ("--workers", 2)], ids=["here", "workers"])
def test_killed_at_ten_random_moments_the_film_ends_up_the_same(arguments, tmp_path, scene, good):
    target, chance = tmp_path / "bar.mp4", random.Random(7)
    for _ in range(10):
        process = started(scene, target, *arguments)
        kill_at_random(process, lambda running: wait_for_more(running, target), chance)
        assert not target.exists()
    assert 0 < frames_done(target) < FRAMES
    check_finished(started(scene, target, *arguments), target, good)


@pytest.mark.slow
def test_killed_while_the_film_is_written_it_ends_up_the_same(tmp_path, good):
    """It is killed when the temporary file of the film is there."""
    scene, target = tmp_path / "scene.toml", tmp_path / "films" / "bar.mp4"
    target.parent.mkdir()
    scene.write_text(json.dumps({"frames": FRAMES}))
    for _ in range(3):
        process = started(scene, target)
        while process.poll() is None and not list(target.parent.glob("*.part")):
            time.sleep(0.001)
        process.kill()
        process.communicate()
    check_finished(started(scene, target), target, good)


@pytest.mark.slow
def test_workers_that_are_killed_change_nothing(tmp_path, scene, good):
    target, chance = tmp_path / "bar.mp4", random.Random(8)
    process = started(scene, target, "--workers", 2)
    for _ in range(10):
        wait_for_more(process, target)
        time.sleep(chance.uniform(0, 0.1))
        while process.poll() is None and not (workers := workers_of(process)):
            time.sleep(0.01)
        assert process.poll() is None, process.communicate()
        with suppress(psutil.NoSuchProcess):
            chance.choice(workers).kill()
    assert frames_done(target) < FRAMES
    check_finished(process, target, good)


@pytest.mark.slow
def test_a_frame_that_kills_its_process_is_told_and_costs_no_other(tmp_path):
    scene, target = tmp_path / "bar.toml", tmp_path / "bar.mp4"
    scene.write_text(json.dumps({"frames": 6, "kills": [2]}))
    process = started(scene, target, "--workers", 2, env={**os.environ, "DEATHS": "3"})
    out = told(process)
    assert process.returncode == 1 and out.count("\n") == 1 and frames_done(target) == 5
    line = "1 of 6 frames failed: frame 2: the process that drew it died each time (too little memory?). The other 5"
    assert line in out


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [(), ("--workers", 2)], ids=["here", "workers"])
def test_an_interrupt_leaves_what_can_be_gone_on_with(arguments, tmp_path, scene, good):
    target = tmp_path / "bar.mp4"
    process = started(scene, target, *arguments, start_new_session=True)
    wait_for_more(process, target)
    workers = workers_of(process)
    # As a terminal does: to all of them.
    os.killpg(process.pid, signal.SIGINT)
    out = told(process)
    assert process.returncode == 130 and out.count("\n") == 1
    line = (
        rf"kerrcaustics: Interrupted: (\d+) frames? (is|are) kept in {frames_folder(target)}; start again to go on.\n"
    )
    assert 1 <= int(re.fullmatch(line, out)[1]) <= frames_done(target)
    _, alive = psutil.wait_procs(workers, timeout=GUARD)
    assert bool(workers) == bool(arguments) and not alive
    assert not list(tmp_path.rglob("*.part")) and frames_done(target) > 0
    check_finished(started(scene, target, *arguments), target, good)


@pytest.mark.slow
def test_an_external_scheduler_whose_workers_come_and_go_gives_the_same_film(tmp_path, scene, good):
    target, worker = tmp_path / "bar.mp4", ("worker", "--nthreads", 1)
    with scheduler(tmp_path) as address:
        with dask(tmp_path, *worker), dask(tmp_path, *worker):
            process = started(scene, target, "--scheduler", address)
            wait_for_more(process, target)
        assert process.poll() is None and frames_done(target) < FRAMES
        with dask(tmp_path, *worker), dask(tmp_path, *worker):
            check_finished(process, target, good)


@pytest.mark.slow
def test_a_file_that_cannot_grow_is_one_line(tmp_path, good):
    """What the system allows a file stands for a disk that is full: frames find room, the film does not."""
    scene, target = tmp_path / "bar.toml", tmp_path / "films" / "bar.mp4"
    target.parent.mkdir()
    scene.write_text(json.dumps({"frames": FRAMES}))
    limit = 20_000
    assert len(good) > limit
    process = started(scene, target, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    out = told(process)
    assert process.returncode == 1 and out.count("\n") == 1, out
    assert f"The film {target} cannot be written: File too large. Frames that are drawn are kept in" in out
    assert frames_done(target) == FRAMES and [file.name for file in target.parent.iterdir()] == [".bar.mp4.frames"]
    check_finished(started(scene, target), target, good)
