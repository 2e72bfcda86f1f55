"""The elementary functions of the kernels: errors against mpmath, special values, and equal bits for all lanes."""

import ctypes
import importlib.util
import mmap
import os
import platform
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest

from kerrcaustics.scripts import STUDIES

SOURCES = Path(__file__).parents[1] / "kerrcaustics" / "beams" / "kernels"
FLAGS = "-std=c++17 -O2 -ffp-contract=off -fno-math-errno -fno-trapping-math -fPIC -shared -Wall -Wextra -Werror"
X86 = platform.machine().lower() in ("x86_64", "amd64")
# Lanes by level of the processor.
LANES = {0: 2, 2: 2, 3: 4, 4: 8}

# Largest errors in units of the last place: the largest of a million arguments, and a margin.
BOUNDS = {"sin": 0.9, "cos": 0.9, "atan": 1.0, "atan2": 1.5, "log": 0.9, "log1p": 0.9, "exp": 1.0, "cbrt": 0.51}
# Functions without an error, and what NumPy calls them.
EXACT = {
    "sqrt": np.sqrt,
    "abs": np.abs,
    "rint": np.rint,
    "floor": np.floor,
    "sign": np.sign,
    "copysign": np.copysign,
    "max": np.maximum,
    "min": np.minimum,
    "rem": np.fmod,
}
ROUNDED = {
    "sin": np.sin,
    "cos": np.cos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "log": np.log,
    "log1p": np.log1p,
    "exp": np.exp,
    "cbrt": np.cbrt,
}
OF_TWO = ("copysign", "max", "min", "rem", "atan2")
SPECIAL = np.array([0, 5e-324, 1e-300, 1e-9, 0.5, 1, 1.5, 2.5, 1e9, 1e15, 2.0**52 + 1, 1e300, np.inf, np.nan])
SPECIAL = np.concatenate([SPECIAL, -SPECIAL])

LANES_OF_TESTS = """
extern "C" void kinds(const In *in, const Out *out, int64_t n) {
  for (int64_t i = 0; i < n; i += W) {
    const V x = load(in, 0, i, n);
    store_f(out, 0, i, n, x);
    store_b(out, 1, i, n, not_(selm(x > 2.0, M_(1), x < 0.0)));
    store_i(out, 2, i, n, rint_(x));
    store_b(out, 3, i, n, finite_(x));
  }
}
// How often numbers are halved until all lanes are at most 1: loops of kernels run so.
extern "C" void halvings(const In *in, const Out *out, int64_t n) {
  for (int64_t i = 0; i < n; i += W) {
    V x = load(in, 0, i, n), count = V_(0.0);
    for (;;) {
      const M go = x > 1.0;
      if (!any_(go)) break;
      count = count + real_(go);
      x = sel(go, x * 0.5, x);
    }
    store_f(out, 0, i, n, count);
  }
}
"""


class Column(ctypes.Structure):
    """A column of numbers in memory."""

    _fields_ = (("at", ctypes.c_void_p), ("stride", ctypes.c_int64))


def source(lanes: int) -> str:
    """A library that has each function for lanes, and for one number (NAME_one) if that is not the same."""
    lines = ['#include "functions.h"', '#include "processor.cc"', LANES_OF_TESTS]
    for name in (*EXACT, *ROUNDED):
        count = 2 if name in OF_TWO else 1
        columns = ", ".join(f"load(in, {k}, i, n)" for k in range(count))
        numbers = ", ".join(f"in[{k}].at[i]" for k in range(count))
        head = "(const In *in, const Out *out, int64_t n) { for (int64_t i = 0; i < n; "
        lines.append(f'extern "C" void {name}_lanes{head} i += W) store_f(out, 0, i, n, {name}_({columns})); }}')
        if lanes > 1:
            lines.append(f'extern "C" void {name}_one{head} i++) ((double *)out->at)[i] = {name}_({numbers}); }}')
    return "\n".join(lines)


def compiler() -> list[str]:
    """A C++ compiler: that of CXX, the module ziglang, or one of the system."""
    if os.environ.get("CXX"):
        return shlex.split(os.environ["CXX"])
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "c++"]
    found = [name for name in ("c++", "g++", "clang++") if shutil.which(name)]
    if not found:
        pytest.skip("there is no C++ compiler: neither ziglang, nor CXX, c++, g++ or clang++")
    return found[:1]


def compiled(folder: Path, lanes: int, level: int) -> Path:
    """The library for some lanes, for a level of x86-64 (0: any processor)."""
    command, library = compiler(), folder / f"lanes{lanes}.so"
    zig = "ziglang" in command or Path(command[0]).stem == "zig"
    command += [*FLAGS.split(), f"-DW={lanes}", f"-I{SOURCES}"]
    # Libraries of macOS are linked with that of the system.
    command += [] if sys.platform == "darwin" else ["-nostdlib"]
    if level:
        command += [f"-mcpu=x86_64_v{level}" if zig else f"-march=x86-64-v{level}"]
    text = folder / f"lanes{lanes}.cc"
    text.write_text(source(lanes), encoding="utf-8")
    subprocess.run([*command, str(text), "-o", str(library)], check=True)
    return library


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """Libraries for one lane on any processor, and for as many lanes as this one has; by lanes."""
    folder = tmp_path_factory.mktemp("kernels")
    one = ctypes.CDLL(str(compiled(folder, 1, 0)))
    level = one.kernel_level()
    lanes = LANES[level]
    return {1: one, lanes: ctypes.CDLL(str(compiled(folder, lanes, level)))}


def values(library, name, *arguments):
    """A function of arrays."""
    columns = [np.ascontiguousarray(x, float) for x in arguments]
    result = np.empty(len(columns[0]))
    inputs = (Column * len(columns))(*[Column(x.ctypes.data, 1) for x in columns])
    getattr(library, name)(inputs, ctypes.byref(Column(result.ctypes.data, 1)), ctypes.c_int64(len(result)))
    return result


def signed(rng, count, low, high):
    """Numbers of any size and sign, uniform in their logarithm."""
    return rng.choice([-1, 1], count) * 10 ** rng.uniform(low, high, count)


def arguments(name, count=2000, seed=1917):
    """Random arguments of one function, half of them where its error is largest."""
    rng, half = np.random.default_rng(seed), count // 2
    if name in ("sin", "cos"):
        # Next to multiples of pi / 2 the angle cancels.
        near_zeros = np.rint(rng.uniform(1, 6e4, half // 2)) * (np.pi / 2)
        return [np.concatenate([rng.uniform(-7, 7, half), signed(rng, half // 2, -12, 5), near_zeros])]
    if name == "atan2":
        near, far = rng.uniform(-2, 2, (2, half)), signed(rng, (2, half), -150, 150)
        return list(np.concatenate([near, far], axis=1))
    by_size = {"atan": (-20, 20), "log": (-307, 308), "log1p": (-20, -0.01), "exp": (-20, 2.84), "cbrt": (-307, 308)}
    between = {"atan": (-4, 4), "log": (0.4, 2), "log1p": (-0.9, 3), "exp": (-1, 1), "cbrt": (-8, 8)}
    sized = signed(rng, half, *by_size[name])
    return [np.concatenate([abs(sized) if name == "log" else sized, rng.uniform(*between[name], half)])]


def errors_in_last_place(name, found, columns):
    """Errors of a function in units of the last place of its true values."""
    true = {"atan2": mpmath.atan2, "cbrt": lambda x: mpmath.sign(x) * mpmath.cbrt(abs(x))}
    function = true.get(name) or getattr(mpmath, name)
    with mpmath.workprec(120):
        exact = [function(*map(mpmath.mpf, row)) for row in zip(*(x.tolist() for x in columns), strict=True)]
        units = np.spacing(np.abs([float(x) for x in exact]))
        pairs = zip(found.tolist(), exact, units.tolist(), strict=True)
        return np.array([float(abs(value - x) / unit) for value, x, unit in pairs])


def assert_same(first, second, name=""):
    """Equal to the bit, but for the bits of NaN."""
    same = (first.view(np.int64) == second.view(np.int64)) | (np.isnan(first) & np.isnan(second))
    assert same.all(), (name, np.flatnonzero(~same)[:5])


def pairs_of_special(name):
    """Special arguments, in all pairs for functions of two."""
    return [SPECIAL] if name not in OF_TWO else [x.ravel() for x in np.meshgrid(SPECIAL, SPECIAL)]


@pytest.mark.parametrize("name", BOUNDS)
def test_errors(libraries, name):
    columns = arguments(name)
    found = values(libraries[1], f"{name}_lanes", *columns)
    assert errors_in_last_place(name, found, columns).max() < BOUNDS[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", BOUNDS)
def test_errors_of_many(libraries, name):
    columns = arguments(name, 20_000, 1918)
    found = values(libraries[1], f"{name}_lanes", *columns)
    assert errors_in_last_place(name, found, columns).max() < BOUNDS[name]


def test_bits_are_those_of_one_lane(libraries):
    rng = np.random.default_rng(1919)
    for name in (*EXACT, *ROUNDED):
        any_size = [signed(rng, 2000, -300, 300) for _ in range(2)]
        columns = [np.concatenate(x) for x in zip(any_size, any_size[::-1], strict=True)][: 2 if name in OF_TWO else 1]
        groups = [columns, pairs_of_special(name), arguments(name) if name in BOUNDS else columns]
        for group in groups:
            expected = values(libraries[1], f"{name}_lanes", *group)
            for suffix in ("lanes", "one"):
                assert_same(values(libraries[max(libraries)], f"{name}_{suffix}", *group), expected, name)


def comparable(name, columns):
    """The special arguments for which a function is meant to give what NumPy gives."""
    x, size = columns[0], abs(columns[0])
    kept = np.ones(len(x), bool)
    if name in ("sin", "cos"):
        kept = ~(size > 1e5) | np.isinf(x)
    if name == "log":
        # Subnormal numbers count as 0.
        kept = ~((size > 0) & (size < 2.0**-1022))
    if name == "rem":
        kept = ~(size / abs(columns[1]) >= 2.0**52) | np.isinf(x) | (columns[1] == 0)
    if name == "atan2":
        # Halves of subnormal numbers are not exact.
        kept = ~(np.maximum(size, abs(columns[1])) < 2.0**-1021) | (columns[1] == 0) | (x == 0)
    return [column[kept] for column in columns]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_special_values_are_those_of_numpy(libraries):
    for name, function in (EXACT | ROUNDED).items():
        columns = comparable(name, pairs_of_special(name))
        found, expected = values(libraries[1], f"{name}_lanes", *columns), function(*columns)
        if name in ("max", "min", "sign"):
            # The sign of zero is anyone's there.
            np.testing.assert_array_equal(found, expected, err_msg=name)
        elif name in EXACT:
            assert_same(found, expected, name)
        else:
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=0, err_msg=name)
            zero = expected == 0
            assert (np.signbit(found) == np.signbit(expected))[zero].all(), name


def test_functions_without_an_error(libraries):
    rng = np.random.default_rng(1920)
    for name, function in EXACT.items():
        sizes = (-3, 12) if name == "rem" else (-300, 300) if name == "sqrt" else (-3, 17)
        columns = [signed(rng, 5000, *sizes), signed(rng, 5000, *sizes)][: 2 if name in OF_TWO else 1]
        if name == "sqrt":
            columns = [abs(columns[0])]
        assert_same(values(libraries[1], f"{name}_lanes", *columns), function(*columns), name)


def test_limits_of_range(libraries):
    one = libraries[1]
    np.testing.assert_array_equal(values(one, "exp_lanes", [709.79, 709.0, -745.2, -746]) > 1e300, [1, 1, 0, 0])
    assert values(one, "exp_lanes", [-740.0])[0] == pytest.approx(np.exp(-740.0), abs=1e-323)
    np.testing.assert_array_equal(values(one, "exp_lanes", [800.0, -800.0, -745.2]), [np.inf, 0, 0])
    np.testing.assert_array_equal(values(one, "log_lanes", [2.0**-1022, 2.0**-1023]), [np.log(2.0**-1022), -np.inf])
    assert np.isnan(values(one, "sin_lanes", [2.0**50, -1e300])).all()
    # The argument counts as rounded once more.
    x = np.random.default_rng(1921).uniform(2e5, 1e9, 1000)
    assert (abs(values(one, "sin_lanes", x) - np.sin(x)) <= np.spacing(x)).all()


def guarded_column(numbers):
    """An array that ends where memory ends, and the memory."""
    page = mmap.PAGESIZE
    memory = mmap.mmap(-1, 2 * page)
    array = np.frombuffer(memory, np.uint8)
    protect = ctypes.CDLL(None, use_errno=True).mprotect
    assert protect(ctypes.c_void_p(array.ctypes.data + page), ctypes.c_size_t(page), 0) == 0
    column = array[page - 8 * len(numbers) : page].view(float)
    column[:] = numbers
    return column, memory


@pytest.mark.skipif(os.name != "posix", reason="memory is guarded by mprotect")
@pytest.mark.parametrize("stride", (1, 3))
def test_nothing_beyond_the_last_number_is_touched(libraries, stride):
    for library in libraries.values():
        for n in range(1, 10):
            x = np.linspace(-3.0, 5.0, n)
            spread = np.full(stride * (n - 1) + 1, np.nan)
            spread[::stride] = x
            column, _memory = guarded_column(spread)
            reals = np.full(3 * n + 20, 7.0)
            bytes_ = np.full((3, 3 * n + 20), 7, np.int8)
            outs = (Column * 4)(Column(reals.ctypes.data, stride), *[Column(row.ctypes.data, stride) for row in bytes_])
            library.kinds(ctypes.byref(Column(column.ctypes.data, stride)), outs, ctypes.c_int64(n))
            expected = [x, (x <= 2) & (x >= 0), np.rint(x), np.ones(n)]
            for found, right in zip([reals, *bytes_], expected, strict=True):
                np.testing.assert_array_equal(found[: stride * n : stride], right)
                found[: stride * n : stride] = 7
                assert (found == 7).all()


def test_a_number_that_all_rays_share(libraries):
    for library in libraries.values():
        result, shared = np.zeros(9), np.array([np.pi])
        columns = Column(shared.ctypes.data, 0), Column(result.ctypes.data, 1)
        library.sin_lanes(ctypes.byref(columns[0]), ctypes.byref(columns[1]), ctypes.c_int64(9))
        np.testing.assert_array_equal(result, np.sin(np.pi))


def test_loops_end_when_all_lanes_have(libraries):
    x = np.array([0.5, 1, 2, 1000, 3, 1e6, 1, 1, 0, -4, 5])
    for library in libraries.values():
        np.testing.assert_array_equal(values(library, "halvings", x), np.ceil(np.log2(np.maximum(x, 1))))


@pytest.mark.skipif(not (X86 and sys.platform == "linux"), reason="/proc/cpuinfo names the instructions")
def test_level_of_the_processor(libraries):
    line = next(x for x in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines() if x.startswith("flags"))
    flags = set(line.split())
    needed = {
        2: {"cx16", "lahf_lm", "popcnt", "pni", "ssse3", "sse4_1", "sse4_2"},
        3: {"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"},
        4: {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
    }
    level = 0
    for step, names in needed.items():
        if not names <= flags:
            break
        level = step
    assert {library.kernel_level() for library in libraries.values()} == {level}


@pytest.mark.slow
def test_coefficients_are_those_of_the_script():
    script = STUDIES.module("truth.elementary_functions")
    assert (SOURCES / "coefficients.h").read_text(encoding="utf-8") == script.header()
