"""Programs are made once, kept in files, and made anew where a file is of no use."""

import os
import threading

import jax.numpy as jnp
import numpy as np
import pytest

from kerrcaustics.beams.programs import Program
from kerrcaustics.spacetime.settings import own_settings

TRACED = []


def doubled(parts, *, twice):
    """Remembers that it was traced."""
    TRACED.append(twice)
    x, y = parts
    return {"sum": x + y, "double": jnp.sin(x) * 2 if twice else None}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    TRACED.clear()
    with own_settings():
        yield tmp_path / "kerrcaustics" / "programs"


def ask(program, count=3, twice=True):
    x = np.arange(count) / 3
    found = program((x, 1.0), twice=twice)
    assert np.array_equal(found["sum"], x + 1) and (found["double"] is not None) == twice
    return found


def test_traced_once_for_each_shape_and_choice(folder):
    program = Program(doubled)
    for _ in range(2):
        ask(program), ask(program, 4), ask(program, twice=False)
    assert TRACED == [True, True, False] and len(list(folder.iterdir())) == 3


def test_a_second_process_reads_it(folder):
    first = ask(Program(doubled))
    again = ask(Program(doubled))
    assert TRACED == [True] and again["double"].tobytes() == first["double"].tobytes()


def test_other_options_are_another_program(folder, monkeypatch):
    ask(Program(doubled))
    monkeypatch.setattr("kerrcaustics.beams.programs._OPTIONS", {"cpu": {"xla_backend_optimization_level": 1}})
    ask(Program(doubled))
    assert len(TRACED) == 2


def test_a_broken_file_is_replaced(folder):
    ask(Program(doubled))
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    path.write_bytes(whole[:100])
    ask(Program(doubled))
    assert len(TRACED) == 2 and len(path.read_bytes()) > 100
    ask(Program(doubled))
    assert len(TRACED) == 2


def test_where_nothing_can_be_kept(folder):
    folder.parent.parent.joinpath("kerrcaustics").write_text("no folder")
    ask(Program(doubled))
    assert len(TRACED) == 1


def test_old_ones_make_room(folder, monkeypatch):
    monkeypatch.setattr("kerrcaustics.beams.programs._MOST_KEPT", 2)
    ask(Program(doubled))
    (oldest,) = folder.iterdir()
    os.utime(oldest, (0, 0))
    ask(Program(doubled), 4), ask(Program(doubled), 5)
    assert len(list(folder.iterdir())) == 2 and not oldest.exists()


def test_threads_wait_for_one_another():
    program = Program(doubled)

    def run():
        with own_settings():
            ask(program)

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert TRACED == [True]


def test_a_failure_is_no_answer():
    program = Program(doubled)
    for _ in range(2):
        with pytest.raises(TypeError):
            program((1.0, "one"), twice=True)
    ask(program)


def test_few_are_held_in_memory(folder, monkeypatch):
    loaded: dict = {}
    monkeypatch.setattr("kerrcaustics.beams.programs._MOST_LOADED", 2)
    monkeypatch.setattr("kerrcaustics.beams.programs._loaded", loaded)
    program = Program(doubled)
    for count in (2, 3, 2, 4, 3, 2):
        ask(program, count)
    # Those that were let go are read again.
    assert len(TRACED) == 3 and len(loaded) == 2
