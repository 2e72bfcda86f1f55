"""Sweeps whose processes are killed, and sweeps on other processes: slow.

Nothing here waits for a number of seconds: what is killed is killed after a block was done. The guards are for a sweep
that hangs.
"""

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest
from command_line import run
from killing import GUARD, dask, kill_at_random, scheduler, told, workers_of
from sweeping import PLAIN, files, opened, written

from kerrcaustics.workers import cluster

# Enough blocks that the ten moments at which something dies lie between the first and the last.
LONG = """
spin = {from = 0.5, to = 0.95, count = 8}
radius = [0.5, 3, 4, 5, 6, 7, 8, 9]
orders = 1
block = 1
compute = ["geometry", "cusps", "areas", "curves"]
"""
# What runs the command line: with the physics, and with numbers that cost nothing but the time to kill a process.
REAL, QUICK = ("-m", "kerrcaustics"), (str(Path(__file__).parent / "quick_sweep.py"),)


def started(program, path, target, *arguments, **settings):
    command = [sys.executable, *program, "sweep", path, "--output", target, *arguments]
    output = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(list(map(str, command)), **output, **settings)


def blocks_done(target):
    return len(list((Path(target) / "status" / "c").glob("*/*/*")))


def wait_for_more(process, target):
    before = blocks_done(target)
    while process.poll() is None and blocks_done(target) == before:
        time.sleep(0.01)


def check_finished(process):
    """The points inside the horizon failed, and no others."""
    out = told(process)
    assert process.returncode == 1 and "kerrcaustics: 8 of 64 points failed." in out, out
    # Nothing that Dask or a process says about itself.
    lines = out.splitlines()
    assert len(lines) == 11 and sum(line.startswith("failed: ") for line in lines) == 8, out


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


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """What a sweep gives that nobody disturbs, by the program that runs it."""
    folder = tmp_path_factory.mktemp("undisturbed")
    path = written(folder, LONG)
    for program in (REAL, QUICK):
        check_finished(started(program, path, folder / f"{len(program)}.zarr"))
    return path, {program: files(folder / f"{len(program)}.zarr") for program in (REAL, QUICK)}


@pytest.mark.slow
@pytest.mark.parametrize("kills, arguments", [(10, ()), (4, ("--workers", 2))], ids=["threads", "workers"])
def test_killed_again_and_again_the_sweep_ends_up_the_same(kills, arguments, tmp_path, undisturbed):
    path, good = undisturbed
    target, chance = tmp_path / "s.zarr", random.Random(7)
    for _ in range(kills):
        process = started(QUICK, path, target, *arguments)
        kill_at_random(process, lambda running: wait_for_more(running, target), chance)
    assert blocks_done(target) < 64
    check_finished(started(QUICK, path, target, *arguments))
    assert files(target) == good[QUICK]


@pytest.mark.slow
def test_workers_that_are_killed_on_a_busy_machine_change_nothing(tmp_path, undisturbed):
    path, good = undisturbed
    target, chance = tmp_path / "s.zarr", random.Random(os.environ.get("CHANCE", 8))
    process = started(REAL, path, target, "--workers", 2)
    with other_work(4):
        for _ in range(10):
            wait_for_more(process, target)
            time.sleep(chance.uniform(0, 0.3))
            while not (workers := workers_of(process)):
                time.sleep(0.01)
            chance.choice(workers).kill()
        assert blocks_done(target) < 64
    check_finished(process)
    assert files(target) == good[REAL]


@pytest.mark.slow
def test_workers_that_are_always_killed_end_the_sweep_which_goes_on_later(tmp_path, undisturbed):
    path, good = undisturbed
    target = tmp_path / "s.zarr"
    process = started(QUICK, path, target, "--workers", 1)
    wait_for_more(process, target)
    while process.poll() is None:
        for worker in workers_of(process):
            with suppress(psutil.NoSuchProcess):
                worker.kill()
        time.sleep(0.05)
    out = told(process)
    assert process.returncode == 1 and out.count("\n") == 1
    assert out.startswith("kerrcaustics: Workers died 40 times without computing anything (too little memory?): ")
    assert 1 <= blocks_done(target) < 64
    check_finished(started(QUICK, path, target, "--workers", 2))
    assert files(target) == good[QUICK]


@pytest.mark.slow
def test_points_that_kill_their_process_are_told_and_cost_no_other(tmp_path):
    path = written(tmp_path, "spin = [0.5, 0.9]\nradius = [3, 13]\norders = 1\nblock = 1\n")
    process = started(QUICK, path, tmp_path / "s.zarr", "--workers", 2, env={**os.environ, "DEATHS": "3"})
    out = told(process)
    lines = out.splitlines()
    assert process.returncode == 1 and lines[-1] == "kerrcaustics: 2 of 4 points failed.", out
    reason = "the process that computed it died each time (too little memory?)"
    assert lines[2:-1] == [f"failed: spin {spin}, radius 13, inclination 90: {reason}" for spin in (0.5, 0.9)]
    assert opened(tmp_path / "s.zarr").status.values[:, :, 0].tolist() == [[1, 2], [1, 2]]


@pytest.mark.slow
def test_an_interrupt_ends_a_sweep_and_its_workers_in_one_line(tmp_path, undisturbed):
    path, good = undisturbed
    target = tmp_path / "s.zarr"
    process = started(QUICK, path, target, "--workers", 2, start_new_session=True)
    wait_for_more(process, target)
    workers = workers_of(process)
    # As a terminal does: to all of them.
    os.killpg(process.pid, signal.SIGINT)
    out = told(process)
    line = f"kerrcaustics: Interrupted: what was computed is kept in {target}; start again to go on.\n"
    assert (process.returncode, out) == (130, line)
    _, alive = psutil.wait_procs(workers, timeout=GUARD)
    assert workers and not alive
    check_finished(started(QUICK, path, target))
    assert files(target) == good[QUICK]


@pytest.mark.slow
def test_a_dask_cluster_that_loses_its_workers_and_gets_others_gives_the_same_store(tmp_path, undisturbed):
    path, good = undisturbed
    target, worker = tmp_path / "s.zarr", ("worker", "--nthreads", 1)
    with scheduler(tmp_path) as address:
        with dask(tmp_path, *worker), dask(tmp_path, *worker):
            process = started(REAL, path, target, "--scheduler", address)
            wait_for_more(process, target)
        assert process.poll() is None and blocks_done(target) < 64
        with dask(tmp_path, *worker), dask(tmp_path, *worker):
            check_finished(process)
    assert files(target) == good[REAL]


@pytest.mark.slow
def test_a_cluster_that_goes_away_ends_the_sweep_which_goes_on_later(tmp_path, undisturbed):
    path, good = undisturbed
    target = tmp_path / "s.zarr"
    with scheduler(tmp_path) as address, dask(tmp_path, "worker", "--nthreads", 1, "--preload", *QUICK):
        process = started(QUICK, path, target, "--scheduler", address)
        wait_for_more(process, target)
    out = told(process)
    assert process.returncode == 1 and out.count("\n") == 1
    assert out.startswith("kerrcaustics: The Dask scheduler went away: the sweep ended. What its store holds is kept;")
    assert 1 <= blocks_done(target) < 64
    check_finished(started(QUICK, path, target))
    assert files(target) == good[QUICK]


@pytest.mark.slow
def test_no_scheduler_is_one_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cluster, "_FIRST_ANSWER", 1)
    path = written(tmp_path, PLAIN)
    arguments = ("--output", tmp_path / "s.zarr", "--scheduler", "tcp://127.0.0.1:9")
    status, out, err = run(capsys, "sweep", path, *arguments)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert (
        "Argument --scheduler must be the address of a Dask scheduler, but 'tcp://127.0.0.1:9' does not answer" in err
    )
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.slow
def test_a_full_disk_on_a_worker_is_one_line(tmp_path, capsys):
    """A file where a folder must be stands for it: the superuser of a container meets it too."""
    path, target = written(tmp_path, PLAIN), tmp_path / "s.zarr"
    assert run(capsys, "sweep", path, "--output", target)[0] == 0
    (target / "status" / "c" / "1" / "1" / "0").unlink()
    (target / "status" / "c" / "1" / "1").rmdir()
    (target / "status" / "c" / "1" / "1").write_text("")
    status, out, err = run(capsys, "sweep", path, "--output", target, "--workers", 1)
    assert (status, out) == (1, "") and err.count("\n") == 1 and "cannot be written: " in err
