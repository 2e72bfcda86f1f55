"""Films and sweeps whose processes are killed, or run elsewhere: slow. What they store ends up the same, to the bit.

Nothing here waits for a number of seconds: what is killed is killed after a frame or a block was done. The guards are
for a program that hangs.
"""

import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import psutil
import pytest
from command_line import run
from filming import MovingBar
from killing import GUARD, dask, kill_at_random, reported, scheduler, workers_of
from sweeping import PLAIN, files, opened, written

from kerrcaustics.films.film import frames_folder, make_film
from kerrcaustics.films.scene_films import scene_film
from kerrcaustics.workers import cluster

pytestmark = pytest.mark.slow

FRAMES = 80
# Enough blocks that the ten moments at which something dies lie between the first and the last.
LONG = """
spin = {from = 0.5, to = 0.95, count = 8}
radius = [0.5, 3, 4, 5, 6, 7, 8, 9]
orders = 1
block = 1
compute = ["geometry", "cusps", "areas", "curves"]
"""
HERE = Path(__file__).parent
# What runs the command line: with the physics, and with what costs nothing but the time to kill a process.
REAL, QUICK, QUICK_FILM = ("-m", "kerrcaustics"), (HERE / "quick_sweep.py",), (HERE / "quick_film.py",)


@dataclass(frozen=True)
class Work:
    """A film or a sweep. done: frames or blocks at a target; interrupted: its last words; good: what it leaves."""

    command: tuple[Any, ...]
    scene: Path
    target: Path
    total: int
    done: Callable[[Path], int]
    interrupted: str
    check: Callable[["Work", Any], None]
    good: Any = None

    def start(self, *arguments, **settings):
        command = [sys.executable, *self.command, self.scene, "--output", self.target, *arguments]
        output = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        return subprocess.Popen(list(map(str, command)), **output, **settings)

    def wait_for_more(self, process):
        before = self.done(self.target)
        while process.poll() is None and self.done(self.target) == before:
            time.sleep(0.005)

    def check_partly_done(self):
        assert 0 < self.done(self.target) < self.total

    def check_finished(self, process):
        """All is there, and is the same; nothing that Dask or a process says about itself."""
        self.check(self, process)


def check_film(work, process):
    out = reported(process)
    assert process.returncode == 0 and out.splitlines()[-1] == f"Film: {work.target}", out
    # A slow machine tells of its progress in encoding, too.
    assert all(line.startswith("encoding, ") or "frames" in line for line in out.splitlines()[:-1]), out
    assert work.target.read_bytes() == work.good
    assert not [file.name for file in work.target.parent.iterdir() if file.name.startswith(".")]


def check_sweep(work, process):
    """The points inside the horizon failed, and no others."""
    out = reported(process)
    assert process.returncode == 1 and "kerrcaustics: 8 of 64 points failed." in out, out
    lines = out.splitlines()
    assert len(lines) == 11 and sum(line.startswith("failed: ") for line in lines) == 8, out
    assert work.good is None or files(work.target) == work.good


def film_in(folder, good=None, **settings):
    scene, target = folder / "bar.toml", folder / "films" / "bar.mp4"
    target.parent.mkdir()
    scene.write_text(json.dumps({"frames": FRAMES, **settings}))
    words = rf"(\d+) frames? (is|are) kept in {frames_folder(target)}"
    return Work((*QUICK_FILM, "film"), scene, target, FRAMES, frames_done, words, check_film, good)


def sweep_in(folder, program, good=None):
    target = folder / "s.zarr"
    words = f"what was computed is kept in {target}"
    return Work((*program, "sweep"), written(folder, LONG), target, 64, blocks_done, words, check_sweep, good)


def frames_done(target):
    return len(list(frames_folder(target).glob("*.png")))


def blocks_done(target):
    return len(list((target / "status" / "c").glob("*/*/*")))


@pytest.fixture(scope="module")
def good_film(tmp_path_factory):
    """The bytes of the film that nobody disturbs, drawn in this process."""
    path = tmp_path_factory.mktemp("good") / "good.mp4"
    make_film(path, scene_film(MovingBar(FRAMES)))
    return path.read_bytes()


@pytest.fixture(scope="module")
def good_stores(tmp_path_factory):
    """The files of the sweep that nobody disturbs, by the program that runs it."""
    stores = {}
    for program in (REAL, QUICK):
        work = sweep_in(tmp_path_factory.mktemp("undisturbed"), program)
        work.check_finished(work.start())
        stores[program] = files(work.target)
    return stores


@pytest.fixture
def sweep(tmp_path, good_stores):
    return sweep_in(tmp_path, QUICK, good_stores[QUICK])


@pytest.fixture
def work(request, tmp_path):
    """A film or a sweep by name: "film", "sweep", or "physics" for the sweep that computes."""
    if request.param == "film":
        return film_in(tmp_path, request.getfixturevalue("good_film"), pause=0.08)
    program = REAL if request.param == "physics" else QUICK
    return sweep_in(tmp_path, program, request.getfixturevalue("good_stores")[program])


@contextmanager
def other_work(processes):
    """Other processes that keep the machine busy."""
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


@pytest.mark.parametrize("work", ["film", "sweep"], indirect=True)
@pytest.mark.parametrize("kills, arguments", [(10, ()), (4, ("--workers", 2))], ids=["here", "workers"])
def test_killed_again_and_again_it_ends_up_the_same(kills, arguments, work):
    chance = random.Random(7)
    for _ in range(kills):
        kill_at_random(work.start(*arguments), work.wait_for_more, chance)
    work.check_partly_done()
    work.check_finished(work.start(*arguments))


@pytest.mark.parametrize("work, busy", [("film", 0), ("physics", 4)], indirect=["work"])
def test_workers_that_are_killed_change_nothing_on_a_busy_machine_too(work, busy):
    chance = random.Random(os.environ.get("CHANCE", 8))
    process = work.start("--workers", 2)
    with other_work(busy):
        for _ in range(10):
            work.wait_for_more(process)
            time.sleep(chance.uniform(0, 0.1))
            while process.poll() is None and not (workers := workers_of(process)):
                time.sleep(0.01)
            assert process.poll() is None, process.communicate()
            with suppress(psutil.NoSuchProcess):
                chance.choice(workers).kill()
        work.check_partly_done()
    work.check_finished(process)


@pytest.mark.parametrize("work", ["film", "sweep"], indirect=True)
@pytest.mark.parametrize("arguments", [(), ("--workers", 2)], ids=["here", "workers"])
def test_an_interrupt_is_one_line_and_ends_the_workers(arguments, work, tmp_path):
    process = work.start(*arguments, start_new_session=True)
    work.wait_for_more(process)
    workers = workers_of(process)
    # As a terminal does: to all of them.
    os.killpg(process.pid, signal.SIGINT)
    out = reported(process)
    words = re.fullmatch(rf"kerrcaustics: Interrupted: {work.interrupted}; start again to resume\.\n", out)
    assert process.returncode == 130 and words, out
    assert not words.groups() or 1 <= int(words[1]) <= work.done(work.target)
    _, alive = psutil.wait_procs(workers, timeout=GUARD)
    assert bool(workers) == bool(arguments) and not alive
    assert not list(tmp_path.rglob("*.part"))
    work.check_partly_done()
    work.check_finished(work.start(*arguments))


@pytest.mark.parametrize("work", ["film", "physics"], indirect=True)
def test_an_external_scheduler_whose_workers_come_and_go_gives_the_same(work, tmp_path):
    worker = "worker", "--nthreads", 1
    with scheduler(tmp_path) as address:
        with dask(tmp_path, *worker), dask(tmp_path, *worker):
            process = work.start("--scheduler", address)
            work.wait_for_more(process)
        assert process.poll() is None
        work.check_partly_done()
        with dask(tmp_path, *worker), dask(tmp_path, *worker):
            work.check_finished(process)


def test_a_film_that_is_killed_while_it_is_written_ends_up_the_same(tmp_path, good_film):
    """It is killed when the temporary file of the film is there."""
    film = film_in(tmp_path, good_film)
    for _ in range(3):
        process = film.start()
        while process.poll() is None and not list(film.target.parent.glob("*.part")):
            time.sleep(0.001)
        process.kill()
        process.communicate()
    film.check_finished(film.start())


def test_a_frame_that_kills_its_process_is_reported_and_costs_no_other(tmp_path):
    film = film_in(tmp_path, frames=6, kills=[2])
    process = film.start("--workers", 2, env={**os.environ, "DEATHS": "3"})
    out = reported(process)
    assert process.returncode == 1 and out.count("\n") == 1 and frames_done(film.target) == 5
    line = "1 of 6 frames failed: frame 2: the process that drew it died each time (too little memory?). The other 5"
    assert line in out


def test_a_file_that_cannot_grow_is_one_line(tmp_path, good_film):
    """The limit of the system on a file stands for a disk that is full: frames find room, the film does not."""
    film, limit = film_in(tmp_path, good_film), 20_000
    assert len(good_film) > limit
    process = film.start(preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    out = reported(process)
    assert process.returncode == 1 and out.count("\n") == 1, out
    assert f"The film {film.target} cannot be written: File too large. The frames drawn so far are kept in" in out
    assert frames_done(film.target) == FRAMES
    assert [file.name for file in film.target.parent.iterdir()] == [".bar.mp4.frames"]
    film.check_finished(film.start())


def test_workers_that_are_always_killed_end_the_sweep_which_goes_on_later(sweep):
    process = sweep.start("--workers", 1)
    sweep.wait_for_more(process)
    while process.poll() is None:
        for worker in workers_of(process):
            with suppress(psutil.NoSuchProcess):
                worker.kill()
        time.sleep(0.05)
    out = reported(process)
    assert process.returncode == 1 and out.count("\n") == 1
    assert out.startswith("kerrcaustics: Workers died 40 times without computing anything (too little memory?): ")
    sweep.check_partly_done()
    sweep.check_finished(sweep.start("--workers", 2))


def test_points_that_kill_their_process_are_reported_and_cost_no_other(tmp_path):
    scene = written(tmp_path, "spin = [0.5, 0.9]\nradius = [3, 13]\norders = 1\nblock = 1\n", "deadly.toml")
    work = replace(sweep_in(tmp_path, QUICK), scene=scene)
    process = work.start("--workers", 2, env={**os.environ, "DEATHS": "3"})
    out = reported(process)
    lines = out.splitlines()
    assert process.returncode == 1 and lines[-1] == "kerrcaustics: 2 of 4 points failed.", out
    reason = "the process that computed it died each time (too little memory?)"
    assert lines[2:-1] == [f"failed: spin {spin}, radius 13, inclination 90: {reason}" for spin in (0.5, 0.9)]
    assert opened(work.target).status.values[:, :, 0].tolist() == [[1, 2], [1, 2]]


def test_a_cluster_that_goes_away_ends_the_sweep_which_goes_on_later(tmp_path, sweep):
    with scheduler(tmp_path) as address, dask(tmp_path, "worker", "--nthreads", 1, "--preload", *QUICK):
        process = sweep.start("--scheduler", address)
        sweep.wait_for_more(process)
    out = reported(process)
    assert process.returncode == 1 and out.count("\n") == 1
    assert out.startswith("kerrcaustics: The Dask scheduler went away: the sweep ended. What its store holds is kept;")
    sweep.check_partly_done()
    sweep.check_finished(sweep.start())


def test_no_scheduler_is_one_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cluster, "FIRST_ANSWER", 1)
    path = written(tmp_path, PLAIN)
    arguments = ("--output", tmp_path / "s.zarr", "--scheduler", "tcp://127.0.0.1:9")
    status, out, err = run(capsys, "sweep", path, *arguments)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert (
        "Argument --scheduler must be the address of a Dask scheduler, but 'tcp://127.0.0.1:9' does not answer" in err
    )
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_on_a_worker_is_one_line(tmp_path, capsys):
    """A file where a folder must be stands for it: the superuser of a container meets it too."""
    path, target = written(tmp_path, PLAIN), tmp_path / "s.zarr"
    assert run(capsys, "sweep", path, "--output", target)[0] == 0
    (target / "status" / "c" / "1" / "1" / "0").unlink()
    (target / "status" / "c" / "1" / "1").rmdir()
    (target / "status" / "c" / "1" / "1").write_text("")
    status, out, err = run(capsys, "sweep", path, "--output", target, "--workers", 1)
    assert (status, out) == (1, "") and err.count("\n") == 1 and "cannot be written: " in err
