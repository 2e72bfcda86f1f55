"""Helpers of tests that kill processes, and that start clusters."""

import json
import os
import re
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil

# Seconds after which a program hangs, however busy the machine is.
GUARD = 3000


def reported(process):
    """The output of a process, without its progress."""
    out, _ = process.communicate(timeout=GUARD)
    return re.sub(r"^(\d+ of \d+ (frames|points)|reading the store|computing).*\n", "", out, flags=re.MULTILINE)


def workers_of(process):
    """The processes that compute for it; what is dead is none."""
    found = []
    with suppress(psutil.NoSuchProcess):
        for child in psutil.Process(process.pid).children(recursive=True):
            with suppress(psutil.NoSuchProcess):
                found += [child] if "spawn_main" in " ".join(child.cmdline()) else []
    return found


def kill_at_random(process, wait_for_more, chance):
    """Kill a program that works, mostly soon after it has done more, and wait for its workers to end."""
    if chance.random() < 0.8:
        wait_for_more(process)
    time.sleep(chance.uniform(0, 0.3))
    workers = workers_of(process)
    assert process.poll() is None, process.communicate()
    process.kill()
    assert reported(process) == ""
    # Workers notice that they are alone.
    psutil.wait_procs(workers, timeout=GUARD)


@contextmanager
def dask(folder, name, *options):
    """A scheduler or a worker of a cluster, until it is killed with all its processes."""
    reported = ("--scheduler-file", folder / "scheduler.json", "--no-dashboard")
    command = [sys.executable, "-m", f"distributed.cli.dask_{name}", *reported, *options]
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    # Where workers find the tests' own modules.
    paths = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    process = psutil.Popen(list(map(str, command)), cwd=folder, env={**os.environ, "PYTHONPATH": paths}, **silent)
    try:
        yield process
    finally:
        for one in (*process.children(recursive=True), process):
            one.kill()
        process.wait()


@contextmanager
def scheduler(folder):
    """The address of a scheduler."""
    reported = folder / "scheduler.json"
    with dask(folder, "scheduler", "--host", "127.0.0.1", "--port", 0):
        while not reported.exists() or not reported.read_text().strip():
            time.sleep(0.1)
        yield json.loads(reported.read_text())["address"]
