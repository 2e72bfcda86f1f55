"""Workers that die or stay away: a sweep bears some of it, and then ends in one line."""

import re
from contextlib import contextmanager
from types import SimpleNamespace

import pytest
from command_line import run
from killing import scheduler
from sweeping import PLAIN, written

import kerrcaustics as kc
from kerrcaustics.sweeps.store import Block
from kerrcaustics.workers import cluster, worker_failures
from kerrcaustics.workers.places import dashboard_of
from kerrcaustics.workers.worker_failures import WorkerFailures, WorkersLost

FIRST, SECOND, THIRD = (Block(0, (i, i + 1), 0) for i in range(3))


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still until it is set."""
    now = [0.0]
    monkeypatch.setattr(worker_failures, "monotonic", lambda: now[0])
    return now


def test_no_worker_is_said_after_thirty_seconds_and_borne_for_five_minutes(clock):
    said = []
    held = WorkerFailures(said.append)
    for clock[0], workers in ((20, 0), (30, 0), (31, 0), (90, 0), (95, 1), (120, 0), (126, 0)):
        held.there_are(workers)
    assert said == ["no worker for 31 s", "no worker for 90 s", "no worker for 31 s"]
    clock[0] = 200
    held.computed()
    clock[0] = 500
    held.there_are(0)
    clock[0] = 501
    held.there_are(0, starting=1)
    with pytest.raises(WorkersLost, match=r"No worker for 301 s: the sweep ended\. What its store holds is kept"):
        held.there_are(0)


def test_a_block_is_given_up_when_twelve_workers_died_with_it():
    held = WorkerFailures(pytest.fail)
    for _ in range(11):
        assert held.died(FIRST)
        held.computed()
    assert held.died(SECOND) and held.died(None)
    assert not held.died(FIRST)
    # Of a cluster, where some die before it is reported.
    assert held.died(THIRD, 4) and held.died(THIRD, 4) and not held.died(THIRD, 4)


@pytest.mark.parametrize("block", [None, FIRST])
def test_deaths_without_anything_computed_end_a_sweep(block):
    held = WorkerFailures(pytest.fail)
    held.there_are(2)
    held.there_are(1)
    for _ in range(79):
        held.died(block)
    held.computed()
    for _ in range(79):
        held.died(block)
    with pytest.raises(WorkersLost, match="Workers died 80 times without computing anything"):
        held.died(block)


@pytest.fixture
def empty_cluster(monkeypatch):
    """A Dask scheduler in this process that has no worker, and a sweep that soon loses patience."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(worker_failures, "SECONDS_UNTIL_SAID", 0.1)
    monkeypatch.setattr(worker_failures, "SECONDS_BORNE", 1.0)
    monkeypatch.setattr(cluster, "SECONDS_BETWEEN_LOOKS", 0.1)
    with distributed.LocalCluster(n_workers=0, processes=False, protocol="tcp", dashboard_address="") as empty:
        yield empty


def test_a_cluster_that_never_has_a_worker_is_one_line(tmp_path, capsys, empty_cluster):
    path, target = written(tmp_path, PLAIN), tmp_path / "s.zarr"
    arguments = ("sweep", path, "--output", target, "--scheduler", empty_cluster.scheduler_address)
    status, out, err = run(capsys, *arguments)
    dashboard, line = err.splitlines()
    assert (status, out) == (1, "") and dashboard.startswith("Dashboard: http://")
    assert re.match(r"kerrcaustics: No worker for \d+ s: the sweep ended. What its store holds is kept; start", line)


def test_a_scheduler_that_goes_away_ends_the_sweep(tmp_path, empty_cluster):
    said = []

    def close(what, _part):
        said.append(what)
        if "no worker" in what:
            empty_cluster.close()

    scene = kc.read_scene(written(tmp_path, PLAIN))
    with pytest.raises(WorkersLost, match="The Dask scheduler went away: the sweep ended"):
        kc.sweep(scene, tmp_path / "s.zarr", scheduler=empty_cluster.scheduler_address, progress=close)
    assert said[-1] == "0 of 6 points, no worker for 0 s"


def test_a_scheduler_whose_dashboard_is_switched_off_names_none(tmp_path):
    """Dask names its page all the same, and answers there that it has none."""
    distributed = pytest.importorskip("distributed")
    with scheduler(tmp_path) as address:
        with distributed.Client(address, set_as_default=False) as client:
            assert client.dashboard_link.startswith("http://")
        assert dashboard_of(address) is None


def test_the_address_of_the_dashboard_is_reported(monkeypatch, capsys, tmp_path):
    """Before the sweep begins; here the scheduler no longer answers then."""
    # Nobody answers there: that a page cannot be reached from here says nothing.
    answers = iter([SimpleNamespace(dashboard_link="http://127.0.0.1:9/status")])

    @contextmanager
    def client_of(_scheduler):
        for client in answers:
            yield client
            return
        raise ValueError("Argument `scheduler` must answer.")

    monkeypatch.setattr(cluster, "client_of", client_of)
    arguments = ("--output", tmp_path / "s.zarr", "--scheduler", "tcp://127.0.0.1:1")
    status, out, err = run(capsys, "sweep", written(tmp_path, PLAIN), *arguments)
    assert (status, out) == (2, "") and err.splitlines() == [
        "Dashboard: http://127.0.0.1:9/status",
        "kerrcaustics: Argument --scheduler must answer.",
    ]
