"""Rules for all tests: types and shapes are checked at run time; and the fixtures that several files share."""

import ctypes
import gc
import os
import re
import sys
from collections import defaultdict
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import jaxtyping
import psutil
import pytest
from command_line import run

from kerrcaustics import scripts

PACKAGE = Path(__file__).parents[1] / "kerrcaustics"
# Modules in which callers meet names, as the stub files have them: these refuse wrong arguments themselves.
PUBLIC = {
    name.replace(".", "/")
    for stub in PACKAGE.glob("*.pyi")
    for name in re.findall(r"^from \.([\w.]+) import", stub.read_text(encoding="utf-8"), re.MULTILINE)
}
# Modules that get what callers pass as it is, and refuse it themselves.
REFUSING = {
    "beams/moving",
    "extended_sources/profiles",
    "functional/rays",
    "functional/traced_arguments",
    "interop/healpix",
    "light_curves/spot_curve",
    "results/progress",
    "scenes/disk/flat",
    "scenes/disk/veil",
    "scenes/scene_checks",
}
# Modules whose functions are called tens of thousands of times.
UNCHECKED = {"beams/ray_end", "beams/calls"}


def checked_modules():
    """All modules whose types are checked: those of every room, but for the sets above and records of results."""
    for path in PACKAGE.rglob("*.py"):
        inside = path.relative_to(PACKAGE).with_suffix("")
        if len(inside.parts) == 1 or inside.name[0] == "_" or inside.as_posix() in PUBLIC | REFUSING | UNCHECKED:
            continue
        if not re.search(r"^@result\(", path.read_text(encoding="utf-8"), re.MULTILINE):
            yield ".".join(("kerrcaustics", *inside.parts))


# GB: when memory is given back, and what must not be kept then.
MUCH, MOST = 3.0, 4.0
# Of each file, the tests of which a case has run; the number of them that check types in the fast suite.
_SEEN = defaultdict(set)
_CHECKED = 3


def pytest_configure(config):
    """Before the package is imported; benchmarks time it as users have it."""
    # Not in the home of whoever runs the tests.
    os.environ.setdefault("KERRCAUSTICS_CACHE", str(PACKAGE.parent / "build" / "cache"))
    if not config.getoption("benchmark_only", default=False):
        jaxtyping.install_import_hook(list(checked_modules()), "typed.checked")


@pytest.fixture(scope="module", autouse=True)
def memory_given_back():
    """Caches of a module's tests do not add up."""
    yield
    if resident() > MUCH / 2:
        if resident() > MUCH and "jax" in sys.modules:
            # What JAX keeps of functions that it has traced, 13 MB of each program that was compiled.
            sys.modules["jax"].clear_caches()
        give_back()


@pytest.fixture(autouse=True)
def types_checked(request):
    """In the first case of each fast test, but for those with stand-ins; in the fast suite of a few of each file.

    Others would take up to twice as long, and the fast suite a third longer.
    """
    unchecked = any(request.node.get_closest_marker(name) for name in ("slow", "stand_ins"))
    seen, name = _SEEN[request.node.path], request.node.originalname
    enough = len(seen) >= _CHECKED and request.config.getoption("markexpr") != ""
    jaxtyping.config.update("jaxtyping_disable", unchecked or name in seen or enough)
    if not unchecked:
        seen.add(name)


@pytest.fixture(autouse=True)
def memory_bounded():
    """Nor does what tests leave behind within a module; nothing keeps more than it should."""
    yield
    if resident() > MUCH:
        give_back()
        assert resident() < MOST, f"{resident():.1f} GB are kept"


def give_back():
    """Let go of what is not needed: the C library keeps what threads have freed, gigabytes in an hour."""
    gc.collect()
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def resident():
    """Memory (GB) of this process."""
    return psutil.Process().memory_info().rss / 1e9


@pytest.fixture(scope="module")
def compiled_code():
    """JAX as the package's formulas have it: for modules that call them themselves."""
    import jax

    from kerrcaustics.spacetime.settings import own_settings

    with own_settings():
        yield
    # What JAX keeps of them is of no use to other modules.
    jax.clear_caches()


@pytest.fixture
def scripts_at(monkeypatch):
    """Let the STUDIES, FIGURES or FILMS of the checkout lie in another folder."""

    def put(kind, folder):
        monkeypatch.setattr(scripts, kind, replace(getattr(scripts, kind), folder=folder))

    return put


@pytest.fixture
def assert_refused(capsys, tmp_path, monkeypatch):
    """Check that a command line is refused: one line on standard error, exit status 2, and no file written."""
    monkeypatch.chdir(tmp_path)

    def check(arguments, complaint):
        before = sorted(tmp_path.rglob("*"))
        status, out, err = run(capsys, *arguments)
        assert (status, out) == (2, "") and err.count("\n") == 1 and complaint in err
        assert sorted(tmp_path.rglob("*")) == before

    return check


@pytest.fixture
def nothing_kept():
    """Critical curves found before are not used, and those found now not afterwards: for who breaks the search."""
    from kerrcaustics.curves.critical_curves import forget

    forget()
    yield
    forget()
