"""Programs are made once, kept in files, and made anew where a file is of no use."""

import fcntl
import hashlib
import os
import pickle
import stat
import threading
import warnings
import zlib
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from kerrcaustics.beams import compile_cache
from kerrcaustics.beams.compile_cache import Program, apart, cache_root, unsafe_cache
from kerrcaustics.spacetime.settings import own_settings

TRACED = []
# Of the rooms whose functions are compiled. A change of one byte there makes all programs of all users anew, which
# takes each of them seconds: change it knowingly, and this number with it.
DIGEST = "6d1a7522e745d4e5"


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
    monkeypatch.setattr("kerrcaustics.beams.compile_cache.OPTIONS", {"cpu": {"xla_backend_optimization_level": 1}})
    ask(Program(doubled))
    assert len(TRACED) == 2


def waved(x):
    return jnp.sin(x), 1 - jnp.cos(x) / 2


def whole(x):
    return sum(waved(x))


def parted(x):
    return sum(apart(waved)(x))


def test_a_part_is_a_computation_of_its_own(folder):
    x = np.linspace(0, 1, 5)
    (one, inlined), (other, called) = ((p(x), p.compiled(x).as_text()) for p in (Program(whole), Program(parted)))
    assert " call(" in called and " call(" not in inlined
    assert np.allclose(one, other, rtol=1e-15, atol=0)


def test_loops_are_fused_where_asked_for(folder):
    x = np.linspace(0, 1, 5)
    loops = [Program(whole, fused=fused).compiled(x).as_text().count(" fusion(") for fused in (False, True)]
    assert loops[1] == 1 < loops[0] and len(list(folder.iterdir())) == 2


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
    monkeypatch.setattr("kerrcaustics.beams.compile_cache.MOST_KEPT", 2)
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


def at_once(programs):
    def run(program):
        with own_settings():
            ask(program)

    threads = [threading.Thread(target=run, args=(program,)) for program in programs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def test_processes_wait_for_one_another(folder):
    """As other processes do: each of these knows of the others by their files alone."""
    at_once([Program(doubled) for _ in range(4)])
    assert TRACED == [True] and len(list(folder.iterdir())) == 1


def test_a_process_that_stands_still_is_not_waited_for(folder, monkeypatch):
    ask(Program(doubled))
    (path,) = folder.iterdir()
    path.unlink()
    monkeypatch.setattr("kerrcaustics.beams.compile_cache.PATIENCE", 0.2)
    with (folder / f".{path.name}.{'0' * 16}.part").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        ask(Program(doubled))
    assert TRACED == [True, True] and path.exists()


def test_a_failure_is_no_answer():
    program = Program(doubled)
    for _ in range(2):
        with pytest.raises(TypeError):
            program((1.0, "one"), twice=True)
    ask(program)


def test_few_are_held_in_memory(folder, monkeypatch):
    loaded: dict = {}
    monkeypatch.setattr("kerrcaustics.beams.compile_cache.MOST_LOADED", 2)
    monkeypatch.setattr("kerrcaustics.beams.compile_cache.loaded_programs", loaded)
    program = Program(doubled)
    for count in (2, 3, 2, 4, 3, 2):
        ask(program, count)
    # Those that were let go are read again.
    assert len(TRACED) == 3 and len(loaded) == 2


def remember(word):
    TRACED.append(word)


class Planted:
    """Remembers that it was unpickled."""

    def __reduce__(self):
        return remember, ("unpickled",)


PLANTED = zlib.compress(pickle.dumps(Planted()))
OTHER = 54321


def give_away(path, monkeypatch):
    """Let something belong to another user: it is given to one, or, without that right, is no longer one's own."""
    if os.geteuid() == 0:
        os.chown(path, OTHER, -1)
    else:
        monkeypatch.setattr("os.geteuid", lambda: OTHER)


def planted(folder):
    """The one program that is kept, with something else in its file."""
    ask(Program(doubled))
    (path,) = folder.iterdir()
    path.write_bytes(PLANTED)
    TRACED.clear()
    return path


def test_files_are_private(folder):
    ask(Program(doubled))
    (path,) = folder.iterdir()
    modes = [stat.S_IMODE(place.stat().st_mode) for place in (folder.parent, folder, path)]
    assert modes == [0o700, 0o700, 0o600] and unsafe_cache() == ""


def test_files_of_the_user_are_read(folder):
    """Planted files are read where it is the user's own: the other tests could not fail else."""
    planted(folder)
    ask(Program(doubled))
    assert TRACED == ["unpickled", True]


@pytest.mark.parametrize("which", ["file", "folder", "above"])
def test_files_of_others_are_not_read(folder, monkeypatch, which):
    path = planted(folder)
    give_away({"file": path, "folder": folder, "above": folder.parent}[which], monkeypatch)
    with warnings.catch_warnings(record=True):
        ask(Program(doubled))
    assert TRACED == [True] and (which == "file" or "belongs to another user" in unsafe_cache())


@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o707])
def test_folders_that_others_write_to_are_not_used(folder, mode):
    path = planted(folder)
    folder.chmod(mode)
    with pytest.warns(RuntimeWarning, match=f"not kept, as others can write to {folder}: "):
        ask(Program(doubled))
    ask(Program(doubled))
    assert TRACED == [True, True] and path.read_bytes() == PLANTED


def test_files_that_others_write_to_are_replaced(folder):
    path = planted(folder)
    path.chmod(0o666)
    ask(Program(doubled))
    assert TRACED == [True] and stat.S_IMODE(path.stat().st_mode) == 0o600
    ask(Program(doubled))
    assert TRACED == [True]


def test_the_cache_of_all_may_be_sticky(folder):
    folder.parents[1].chmod(0o1777)
    ask(Program(doubled)), ask(Program(doubled))
    assert TRACED == [True]
    folder.parents[1].chmod(0o777)
    with pytest.warns(RuntimeWarning, match="others can write to"):
        ask(Program(doubled))
    assert TRACED == [True, True]


def test_links_are_neither_read_nor_written_through(folder, tmp_path):
    path = planted(folder)
    elsewhere = tmp_path / "precious"
    path.rename(elsewhere)
    path.symlink_to(elsewhere)
    ask(Program(doubled))
    assert TRACED == [True] and elsewhere.read_bytes() == PLANTED and not path.is_symlink()
    folder.rename(tmp_path / "programs")
    folder.symlink_to(tmp_path / "programs")
    with pytest.warns(RuntimeWarning, match="is a link"):
        ask(Program(doubled))
    assert TRACED == [True, True] and unsafe_cache() == f"{folder} is a link"


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir], ids=["pipe", "folder"])
def test_what_is_no_file_is_not_waited_for(folder, make):
    path = planted(folder)
    path.unlink()
    make(path)

    def run():
        with own_settings():
            ask(Program(doubled))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(60)
    assert not thread.is_alive() and TRACED == [True]


def test_foreign_files_are_not_removed(folder, monkeypatch):
    monkeypatch.setattr("kerrcaustics.beams.compile_cache.MOST_KEPT", 1)
    ask(Program(doubled))
    (first,) = folder.iterdir()
    foreign = [folder / name for name in ("letter.txt", first.name[:-1], f"{first.name}.bak")]
    left = folder / f".{first.name}.0123456789abcdef.part"
    for path in (*foreign, left, first):
        path.touch()
        os.utime(path, (0, 0))
    link = first.with_name(first.name[:-1] + "-")
    link.symlink_to(foreign[0])
    ask(Program(doubled), 4)
    assert all(path.exists() for path in (*foreign, link)) and not first.exists() and not left.exists()


def test_a_cache_that_is_read_only_is_read(folder, monkeypatch):
    """It keeps the times of its files."""
    ask(Program(doubled))

    def refused(*_, **__):
        raise PermissionError

    monkeypatch.setattr("os.utime", refused)
    ask(Program(doubled))
    assert TRACED == [True]


def test_nothing_is_made_in_the_home_of_another(folder, tmp_path, monkeypatch):
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / ".cache"))
    give_away(home, monkeypatch)
    with warnings.catch_warnings(record=True):
        ask(Program(doubled))
    assert list(home.iterdir()) == []


def test_no_cache_in_the_current_folder(monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", ".cache")
    assert cache_root().is_absolute()
    monkeypatch.setenv("HOME", "here")
    assert cache_root() is None
    ask(Program(doubled))
    assert TRACED == [True]


def test_rooms_of_compiled_functions_change_knowingly():
    package = Path(compile_cache.__file__).parents[1]
    files = [path for room in compile_cache.SOURCES for path in sorted((package / room).rglob("*.py"))]
    assert hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16] == DIGEST
