"""Sweeps whose processes are killed, and sweeps on other processes: slow."""

import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from command_line import run
from sweeping import PLAIN, files, written

# Enough blocks that the ten moments at which something dies lie between the first and the last.
LONG = """
spin = {from = 0.5, to = 0.95, count = 12}
radius = [0.5, 3, 4, 5, 6, 7, 8, 9]
orders = 1
block = 1
compute = ["geometry", "cusps", "areas", "curves"]
"""


def started(path, target, *arguments):
    command = [sys.executable, "-m", "kerrcaustics", "sweep", path, "--output", target, *arguments]
    return subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def blocks_done(target):
    return len(list((Path(target) / "status" / "c").glob("*/*/*")))


def wait_for_more(process, target):
    before = blocks_done(target)
    while process.poll() is None and blocks_done(target) == before:
        time.sleep(0.01)


def check_finished(process):
    """The points inside the horizon failed, and no others."""
    out, _ = process.communicate(timeout=600)
    assert process.returncode == 1 and "kerrcaustics: 12 of 96 points failed." in out, out
    # Nothing that Dask says about itself.
    lines = out.splitlines()
    assert len(lines) == 15 and sum(line.startswith("failed: ") for line in lines) == 12, out


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    path = written(folder, LONG)
    check_finished(started(path, folder / "s.zarr"))
    return path, files(folder / "s.zarr")


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [(), ("--workers", 2)], ids=["threads", "workers"])
def test_killed_ten_times_the_sweep_ends_up_the_same(arguments, tmp_path, undisturbed):
    path, good = undisturbed
    target, chance = tmp_path / "s.zarr", random.Random(7)
    kills = 0
    while kills < 10:
        process = started(path, target, *arguments)
        if chance.random() < 0.8:
            wait_for_more(process, target)
            time.sleep(chance.uniform(0, 0.3))
        else:
            time.sleep(chance.uniform(0, 5))
        assert process.poll() is None, process.communicate()
        process.kill()
        process.communicate()
        kills += 1
    assert blocks_done(target) < 96
    # Workers notice that they are alone.
    if arguments:
        time.sleep(2)
    check_finished(started(path, target, *arguments))
    assert files(target) == good


@pytest.mark.slow
def test_workers_that_are_killed_change_nothing(tmp_path, undisturbed):
    path, good = undisturbed
    target, chance = tmp_path / "s.zarr", random.Random(8)
    process = started(path, target, "--workers", 2)
    kills = 0
    while kills < 10:
        wait_for_more(process, target)
        time.sleep(chance.uniform(0, 0.3))
        children = psutil.Process(process.pid).children(recursive=True)
        workers = [child for child in children if "spawn_main" in " ".join(child.cmdline())]
        if workers:
            chance.choice(workers).send_signal(signal.SIGKILL)
            kills += 1
    assert blocks_done(target) < 96
    check_finished(process)
    assert files(target) == good


@pytest.mark.slow
def test_a_dask_cluster_of_other_processes_gives_the_same_store(tmp_path, undisturbed):
    path, good = undisturbed
    told = tmp_path / "scheduler.json"
    options = ("--scheduler-file", told, "--no-dashboard")
    commands = [("dask_scheduler", *options, "--host", "127.0.0.1", "--port", 0)]
    commands += [("dask_worker", *options, "--nthreads", 1)] * 2
    helpers = []
    try:
        for name, *rest in commands:
            command = [sys.executable, "-m", f"distributed.cli.{name}", *map(str, rest)]
            helpers.append(
                subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            )
        while not told.exists() or not told.read_text().strip():
            time.sleep(0.1)
        address = json.loads(told.read_text())["address"]
        check_finished(started(path, tmp_path / "s.zarr", "--scheduler", address))
    finally:
        for helper in helpers:
            helper.terminate()
        for helper in helpers:
            helper.wait(timeout=60)
    assert files(tmp_path / "s.zarr") == good


@pytest.mark.slow
def test_no_scheduler_is_one_line(tmp_path, capsys):
    path = written(tmp_path, PLAIN)
    arguments = ("--output", tmp_path / "s.zarr", "--scheduler", "tcp://127.0.0.1:9")
    status, out, err = run(capsys, "sweep", path, *arguments)
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert (
        "Argument --scheduler must be the address of a Dask scheduler, but 'tcp://127.0.0.1:9' does not answer" in err
    )


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
