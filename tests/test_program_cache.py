"""Compiled gradients are kept for the next process, in a folder that may be shared, damaged, full or closed."""

import os
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

from kerrcaustics.beams import program_cache

# A function of some seconds, its value, the folder, and how many programs came from there.
PROGRAM = """
import warnings; warnings.simplefilter("error")
import jax, kerrcaustics as kc
hits = []
jax.monitoring.register_event_listener(lambda event, **_: hits.append(event) if event.endswith("cache_hits") else None)
value = kc.functional.travel_time(0.9, 10.0, 1.0, [-0.6, 0.5, 0.4])
print(repr(float(value)), len(hits), jax.config.jax_compilation_cache_dir)
"""


def started(program=PROGRAM, **settings):
    """A process with other settings of the environment."""
    names = ("KERRCAUSTICS_CACHE", "XDG_CACHE_HOME", "JAX_COMPILATION_CACHE_DIR", "JAX_ENABLE_COMPILATION_CACHE")
    usual = {name: value for name, value in os.environ.items() if name not in names}
    call = [sys.executable, "-c", program]
    return subprocess.Popen(call, env=usual | settings, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def answer(process):
    """Value, hits and folder that a process prints, which says nothing else."""
    out, err = process.communicate()
    assert process.returncode == 0 and err == "", err[-2000:]
    return out.split()


@pytest.mark.slow
def test_a_second_process_compiles_nothing(tmp_path):
    """Also if two begin together, and one finds half of a program."""
    together = [started(XDG_CACHE_HOME=str(tmp_path)) for _ in range(2)]
    first, other = map(answer, together)
    assert first[0] == other[0] and Path(first[2]).is_relative_to(tmp_path / "kerrcaustics" / "jax")
    kept = list(Path(first[2]).glob("*-cache"))
    assert kept and answer(started(XDG_CACHE_HOME=str(tmp_path)))[:2] == [first[0], str(len(kept))]
    for file in kept:
        file.write_bytes(file.read_bytes()[:1000])
        os.utime(file, (1e9, 1e9))
    (Path(first[2]) / "checked").unlink()
    assert answer(started(XDG_CACHE_HOME=str(tmp_path)))[:2] == [first[0], "0"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "folder"),
    [
        ({"XDG_CACHE_HOME": "/proc/no"}, "None"),
        ({"KERRCAUSTICS_CACHE": "/dev/null"}, "None"),
        ({"KERRCAUSTICS_CACHE": ""}, "None"),
        ({"JAX_ENABLE_COMPILATION_CACHE": "0", "KERRCAUSTICS_CACHE": "unused"}, "None"),
        ({"JAX_COMPILATION_CACHE_DIR": "own"}, "own"),
    ],
    ids=str,
)
def test_without_a_folder_there_is_an_answer_and_no_word(settings, folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    settings = settings | {"PYTHONPATH": str(Path(__file__).parents[1])}
    assert answer(started(**settings))[1:] == ["0", folder]
    assert not (tmp_path / "unused").exists()


def test_what_is_damaged_or_too_much_goes(tmp_path, monkeypatch):
    """All but a program that another process may still be writing."""
    whole = zlib.compress(os.urandom(1000))
    monkeypatch.setenv("KERRCAUSTICS_CACHE", str(tmp_path))
    folder = program_cache.cache_folder()
    folder.mkdir(parents=True)
    contents = {"whole": whole, "half": whole[:500], "other": b"zstd", "empty": b"", "begun": whole[:500]}
    for name, content in contents.items():
        (folder / f"{name}-cache").write_bytes(content)
        if name != "begun":
            os.utime(folder / f"{name}-cache", (1.5e9, 1.5e9))
    program_cache.tidy(folder)
    assert {file.name for file in folder.glob("*-cache")} == {"whole-cache", "other-cache", "begun-cache"}
    for number in range(4):
        with open(folder / f"large{number}-cache", "wb") as file:
            file.truncate(200_000_000)
        os.utime(folder / f"large{number}-cache", (1.6e9 + number, 1.6e9 + number))
    program_cache.tidy(folder)
    # The latest, of 500 MB in all.
    assert {file.name for file in folder.glob("*-cache")} == {"large3-cache", "large2-cache", "begun-cache"}


def test_processors_share_no_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("KERRCAUSTICS_CACHE", str(tmp_path))
    here = program_cache.cache_folder()
    assert here.parent == tmp_path / "jax" and here == program_cache.cache_folder()
    monkeypatch.setattr(program_cache, "instructions", lambda: "another processor")
    assert program_cache.cache_folder() not in (None, here)
