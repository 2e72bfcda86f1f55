"""Rules for all tests: types and shapes are checked at run time; and the fixtures that several files share."""

import ctypes
import gc
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import jaxtyping
import psutil
import pytest
from command_line import run

from kerrcaustics import scripts

# Modules whose types are checked. Left out are those that callers meet, which refuse wrong arguments themselves, and
# results; and ray_end and calls, which are called tens of thousands of times.
SPACETIME = ("cubic", "elliptic", "kerr", "polar", "radial", "sphere")
ASTRONOMY = ("plate_carree",)
BEAMS = (
    *("accelerator", "accuracy", "bundle_formulas", "closed_form", "dispatch", "emitters", "errors", "geometry"),
    *("integrator", "traced_ends", "traced_results", "vectors"),
)
CURVES = ("critical_curves", "critical_points", "features", "winding")
FILMS = ("frame_store", "video")
IMAGES = ("fold", "search", "sheet_cells", "sheet_grids", "sheets")
EXPLORER = ("answers", "page_data")
SCENE_FILES = ("camera_motion", "expressions", "orientation")
# Rooms that are checked but for these modules.
ALL_BUT = {
    "numerics": (),
    "orbits": (),
    "lens_map": (),
    "level_curves": (),
    "tracks": (
        *("circles", "event_derivatives", "events", "following", "isoradials"),
        *("lines", "track", "tracks"),
    ),
    "extended_sources": ("magnification", "profiles"),
    "light_curves": ("light_curve", "results", "sources", "spot_curve"),
    "waves": ("amplification", "pattern"),
}
ROOMS = {
    "films": FILMS,
    "spacetime": SPACETIME,
    "interop": ASTRONOMY,
    "beams": BEAMS,
    "curves": CURVES,
    "images": IMAGES,
    "scene_files": SCENE_FILES,
    "explorer": EXPLORER,
}
# GB: when memory is given back, and what must not be kept then.
MUCH, MOST = 3.0, 4.0
# Tests of which a case has run.
_SEEN = set()
PACKAGE = Path(__file__).parents[1] / "kerrcaustics"
WHOLE = {
    room: [name for path in (PACKAGE / room).iterdir() if (name := path.stem)[0] not in "._" and name not in but]
    for room, but in ALL_BUT.items()
}
CHECKED = [f"kerrcaustics.{room}.{name}" for room, names in (ROOMS | WHOLE).items() for name in names]
CHECKED += ["kerrcaustics.draw"]


def pytest_configure(config):
    """Before the package is imported; benchmarks time it as users have it."""
    if not config.getoption("benchmark_only", default=False):
        jaxtyping.install_import_hook(CHECKED, "typed.checked")


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
    """In the first case of each fast test, but for those with stand-ins: others would take up to twice as long."""
    unchecked = any(request.node.get_closest_marker(name) for name in ("slow", "stand_ins"))
    test = request.node.path, request.node.originalname
    jaxtyping.config.update("jaxtyping_disable", unchecked or test in _SEEN)
    _SEEN.add(test)


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
