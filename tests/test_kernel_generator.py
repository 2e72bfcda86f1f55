"""The generator of kernels: functions of one ray as graphs, in doubles, in long arithmetic and as compiled C++."""

import ctypes
import math
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from mpmath import mp

from kerrcaustics.beams.kernels.build import build_library, levels_for, platform_here
from kerrcaustics.beams.kernels.divisions import with_merged_divisions
from kerrcaustics.beams.kernels.emission import emitted, literal
from kerrcaustics.beams.kernels.evaluation import evaluated
from kerrcaustics.beams.kernels.graph import FLAG, Graph, live
from kerrcaustics.beams.kernels.library import Kernel
from kerrcaustics.beams.kernels.lowering import Lowered, lowered
from kerrcaustics.beams.kernels.tables import Table, table_row
from kerrcaustics.spacetime.settings import own_settings
from studies.truth.rounding import long_outputs, rounding_errors

NAN, INF = math.nan, math.inf
# Both signs of all that is special, in all pairs; a number of rays that fills no whole number of lanes.
SPECIAL = (0.0, -0.0, 1.0, -2.5, 1e300, INF, -INF, NAN)
PAIRS = np.array([(x, y) for x in SPECIAL for y in SPECIAL] + [(0.3, 1.7)])
NUMBERS = np.random.default_rng(66).uniform(-3, 3, (101, 3))
LANES = (1, 4)
TABLE = np.array([[0.5, 0.0, -1.0], [0.25, 2.0, 0.0], [0.0, 0.0, 3.0]])


def arithmetic(x, y):
    return {"sum": x + y, "difference": x - y, "product": x * y, "quotient": x / y, "even": jnp.round(x)}


def signs(x, y):
    return jnp.copysign(x, y), x + 0.0, x * 0.0, 0.0 - x, -(x * -1.0), jnp.abs(-x), jnp.sign(x), x - (-y)


def comparisons(x, y):
    kept = (x < y) | ~(x >= y)
    return kept, (x == y) ^ (x != y), jnp.isfinite(x), jnp.isnan(y), jnp.where(kept, x, y), (x > 0) == (y > 0)


def limits(x, y):
    # Of two zeros either may be the greater.
    greater, less = (jnp.where(x == y, x, chosen(x, y)) for chosen in (jnp.maximum, jnp.minimum))
    return greater, less, jnp.clip(x, -1.0, 1.0), jnp.floor(x), jnp.ceil(y)


def functions(x, y, z):
    return jnp.sin(x), jnp.cos(x), jnp.arctan2(y, x), jnp.cbrt(z), jnp.exp(y), jnp.log1p(z * z), jnp.arcsin(x / 3)


def powers(x, y, z):
    return x**7, x**-2, jnp.abs(y) ** 1.25, jnp.abs(y) ** -0.5, jnp.abs(z) ** (1 / 12), jnp.remainder(x, y)


def arrays(v, m):
    rows = jnp.stack([v, v[::-1], jnp.cross(v, jnp.array([1.0, 2.0, 3.0]))])
    return rows @ TABLE, jnp.sum(rows * v[:, None], axis=0), rows.T.reshape(-1)[2:7:2], jnp.cumsum(m * v), rows[1:, ::2]


def staged(x, y, z):
    """Stages in a table, as those of the integrator: each takes those before."""
    table = jnp.asarray(TABLE)

    def stage(i, slopes):
        return slopes.at[i].set(jnp.cos(x + y * (table[i] @ slopes)))

    return jax.lax.fori_loop(0, 3, stage, jnp.zeros(3))


def loops(x, y, z):
    """Two loops, one after the other, that end for each ray at another turn; some at once."""

    def turn(now):
        count, value, is_odd = now
        return count + 1, 0.5 * value + 0.1, ~is_odd

    first = jax.lax.while_loop(lambda now: jnp.abs(now[1]) > 0.3, turn, (0, x, False))
    second = jax.lax.while_loop(lambda now: now[0] < 3 * first[1] + y, lambda now: (now[0] + 1, now[1] * z), (0.0, 1.0))
    return first, second


def branches(x, y, z):
    return jax.lax.cond(x > y, lambda a: a + z, lambda a: a * z, x), jax.lax.switch(2, [jnp.sin, jnp.cos, jnp.abs], y)


def varied(x, y, z):
    value, rate = jax.jvp(lambda a, b: jnp.sin(a) * b / (1 + a * a), (x, y), (1.0, z))
    _, linear = jax.linearize(lambda a: jnp.exp(-a) * jnp.sqrt(1 + a * a), x)
    return value, rate, jax.vmap(linear)(jnp.stack([y, z]))


def quotients(x, y, z):
    return x / y, z / y, (x + 1) / y, x / 3.0, 1.0 / z


def whole(x, y, z):
    turns = jnp.floor(x)
    return jnp.where(y > 0, jnp.where(z > 0, 3, 1), 0).astype(jnp.int8), turns.astype(int) + 1, (y > z) * turns + 1


# Of halves the least one too, which is subnormal.
TABLES = [
    np.array([[0.1, -2.5], [3e9, 1e-300], [7.0, -0.0]]),
    np.array([[0.1, 1e-40, 3e38]], np.float32),
    np.array([[-0.1], [65504], [6e-8], [6.2e-5], [0]], np.float16),
]


def lookups(tables, x, y):
    """Rows by indices that rays compute, before and within a loop, beyond both ends too; and by one of the call."""

    def turn(now):
        return now[0] + 1, now[1] + table_row(tables[0], jnp.floor(now[0] / 2))[0] * x

    loop = jax.lax.while_loop(lambda now: now[0] < 2 * jnp.abs(y), turn, (0.0, y))
    return *(table_row(table, jnp.floor(2 * x)) for table in tables), table_row(tables[2], 1.0), loop[1]


SAMPLES = {
    **{f.__name__: (f, PAIRS) for f in (arithmetic, signs, comparisons, limits)},
    **{f.__name__: (f, NUMBERS) for f in (functions, powers, staged, loops, branches, varied, quotients, whole)},
    "arrays": (arrays, np.concatenate([NUMBERS, NUMBERS[::-1, :1]], axis=1)),
}


def arguments_of(name: str, ray: np.ndarray) -> tuple[object, ...]:
    return (ray[:3], ray[3]) if name == "arrays" else tuple(ray)


@cache
def lowered_sample(name: str) -> Lowered:
    function, rays = SAMPLES[name]
    arguments = arguments_of(name, rays[0])
    return lowered(function, arguments, [True] * len(arguments))


@cache
def by_jax(name: str) -> list[np.ndarray]:
    """All leaves of the result for all rays."""
    function, rays = SAMPLES[name]
    of_rays = jax.vmap(lambda ray: function(*arguments_of(name, ray)))
    with own_settings():
        # Compiled by XLA, x + 0 would be x.
        results = (of_rays if name == "signs" else jax.jit(of_rays))(rays)
    return [np.asarray(leaf) for leaf in jax.tree.leaves(results)]


def leaves_of(function: Lowered, outputs: list[np.ndarray], count: int) -> list[np.ndarray]:
    """Outputs, one for each element, as arrays with an entry for each ray."""
    numbers = [np.broadcast_to(output, count) for output in outputs]
    columns = [
        [values for values, output in zip(numbers, function.outputs, strict=True) if output.leaf == leaf]
        for leaf in range(len(function.shapes))
    ]
    shapes = [(count, *leaf.shape) for leaf in function.shapes]
    return [np.stack(column, axis=-1).reshape(shape) for column, shape in zip(columns, shapes, strict=True)]


def assert_same(results: list[np.ndarray], expected: list[np.ndarray]) -> None:
    """Equal to a few roundings, zeros to their signs."""
    for result, truth in zip(results, expected, strict=True):
        np.testing.assert_allclose(result.astype(float), truth.astype(float), rtol=3e-15, atol=2e-16)
        is_zero = (result == 0) & (truth == 0)
        np.testing.assert_array_equal(np.signbit(result[is_zero]), np.signbit(truth[is_zero]))


@pytest.mark.parametrize("name", SAMPLES)
def test_graphs_are_the_functions(name):
    function, rays = lowered_sample(name), SAMPLES[name][1]
    for one in (function, with_merged_divisions(function)):
        assert_same(leaves_of(one, evaluated(one, [], rays.T), len(rays)), by_jax(name))


def test_shapes_and_structure_are_those_of_jax():
    function = lowered_sample("arithmetic")
    leaves = jax.tree.unflatten(function.tree, function.shapes)
    assert sorted(leaves) == ["difference", "even", "product", "quotient", "sum"]
    assert [leaf.dtype for leaf in lowered_sample("whole").shapes] == [np.int8, np.int64, np.float64]
    assert [output.kind for output in lowered_sample("loops").outputs] == ["i", "f", "b", "f", "f"]


def test_numbers_of_the_call_are_kept_apart():
    """Operations of parameters alone are uniform; arrays take parameters in a row; flags are numbers."""
    function = lowered(
        lambda p, flag, x: jnp.where(flag, p @ p, 0.0) * x, (np.ones(2), True, 1.0), (False, False, True)
    )
    assert (function.parameters, function.columns) == (3, 1)
    uniform = [
        function.graph.nodes[n].operation for n in live(function.graph, function.roots) if function.graph.uniform[n]
    ]
    assert uniform.count("mul") == 2 and uniform.count("select") == 1
    np.testing.assert_array_equal(evaluated(function, [3.0, 4.0, 1.0], [np.array([1.0, 2.0])])[0], [25.0, 50.0])
    with pytest.raises(ValueError, match="3 parameters and 1 columns"):
        evaluated(function, [1.0], [1.0])


def test_equal_operations_are_one_node():
    function = lowered(lambda x, y: (x * y + 1, 1 + y * x, jnp.negative(-x) * y), (1.0, 2.0), (True, True))
    first, second, third = function.roots
    assert first == second
    assert third in function.graph.nodes[first].arguments


def test_exact_simplifications_alone():
    graph = Graph()
    x, zero, minus_zero, one = graph.make("in", (), 0), graph.const(0.0), graph.const(-0.0), graph.const(1.0)
    assert (
        graph.operation("sub", x, zero) == graph.operation("add", x, minus_zero) == graph.operation("mul", x, one) == x
    )
    assert graph.operation("add", x, zero) != x
    assert graph.value(graph.operation("mul", x, zero)) is None
    assert graph.value(graph.operation("sub", x, x)) is None
    assert graph.operation("div", x, graph.const(4.0)) == graph.operation("mul", x, graph.const(0.25))
    assert graph.nodes[graph.operation("div", x, graph.const(3.0))].operation == "div"
    flag = graph.operation("lt", x, one, kind=FLAG)
    assert graph.operation("not", graph.operation("not", flag, kind=FLAG), kind=FLAG) == flag
    # Not even x < 1 and not x >= 1 are the same: x may be NaN.
    assert graph.operation("not", graph.operation("ge", x, one, kind=FLAG), kind=FLAG) != flag


def test_constants_are_folded_as_they_are_rounded():
    graph = Graph()
    third = graph.operation("div", graph.const(1.0), graph.const(3.0))
    assert graph.value(third) == 1 / 3
    assert math.copysign(1.0, graph.value(graph.operation("neg", graph.const(0.0)))) == -1.0
    assert math.isnan(graph.value(graph.operation("div", graph.const(0.0), graph.const(0.0))))
    assert graph.value(graph.operation("sin", graph.const(1.0))) is None


def test_whole_powers_take_few_products():
    graph = Graph()
    graph.power(graph.make("in", (), 0), 12)
    assert [node.operation for node in graph.nodes].count("mul") == 4


def divisions(function: Lowered) -> int:
    return [function.graph.nodes[n].operation for n in live(function.graph, function.roots)].count("div")


def test_quotients_by_one_number_share_a_division():
    function = lowered_sample("quotients")
    assert (divisions(function), divisions(with_merged_divisions(function))) == (5, 2)
    alone = lowered(lambda x, y: x / y, (1.0, 2.0), (True, True))
    assert with_merged_divisions(alone).graph.nodes == alone.graph.nodes


@pytest.mark.parametrize(
    "function",
    [
        lambda x: x.astype(int),
        lambda x: jnp.zeros(3)[jnp.floor(x).astype(int)],
        lambda x: jax.lax.erf(x),
        lambda x: x.astype(jnp.float32),
        lambda x: jax.lax.while_loop(
            lambda a: a < 9, lambda a: jax.lax.while_loop(lambda b: b < a + 2, lambda b: b + 1, a), x
        ),
    ],
    ids=["truncation", "unknown index", "unknown function", "half the digits", "loop in a loop"],
)
def test_what_kernels_cannot_do_is_said(function):
    with pytest.raises(NotImplementedError, match="Kernels have no"):
        emitted(lowered(lambda x: function(jnp.asarray(x)), (1.0,), (True,)), "none")


def test_long_arithmetic_knows_what_rounding_loses():
    """1 - cos x of small x, which loses all digits in doubles; a loop; a function of special numbers."""
    function = lowered(lambda x: 1 - jnp.cos(x), (1.0,), (True,))
    (exact,) = long_outputs(function, [], [1e-9])
    assert exact == pytest.approx(mp.mpf(5e-19), rel=1e-15)
    assert rounding_errors(function, [], np.array([[1e-9]])) == pytest.approx(5e-19, rel=1e-15)
    errors = rounding_errors(lowered_sample("loops"), [], NUMBERS[:20])
    assert 0 < abs(errors).max() < 1e-14


@pytest.mark.parametrize("name", [name for name in SAMPLES if name != "signs"])
def test_long_arithmetic_is_that_of_doubles(name):
    """But for zeros, which have no sign there, and what they decide."""
    function, rays = lowered_sample(name), SAMPLES[name][1]
    rays = rays[~(np.signbit(rays) & (rays == 0)).any(axis=1)][::4]
    exact = np.array([[float(x) for x in long_outputs(function, [], ray, 40)] for ray in rays])
    doubles = np.stack(np.broadcast_arrays(*evaluated(function, [], rays.T)), axis=-1)
    np.testing.assert_allclose(exact, doubles, rtol=3e-15, atol=3e-16)


def test_constants_are_written_to_the_bit():
    values = (0.1, -0.0, 1e-320, 2**53 + 2.0, INF, -INF, True)
    assert [literal(value) for value in values] == [
        "0.1",
        "(-0.0)",
        "1e-320",
        "9007199254740994.0",
        "INF",
        "(-INF)",
        "1",
    ]
    assert literal(NAN) == "NOTANUMBER"


class Slot(ctypes.Structure):
    """A column as kernels take it."""

    _fields_ = (("at", ctypes.c_void_p), ("stride", ctypes.c_int64))


def slots(arrays: list[np.ndarray]) -> ctypes.Array[Slot]:
    """The elements of arrays (ray, ...), each as a column."""
    columns = []
    for array in arrays:
        size = array[0].size
        columns += [Slot(array.ctypes.data + array.itemsize * i, size) for i in range(size)]
    return (Slot * len(columns))(*columns)


@cache
def lowered_lookups() -> Lowered:
    tables = [Table(table.shape[1], table.dtype.str[1:]).value for table in TABLES]
    return lowered(lookups, (tables, 0.5, 0.5), (None, None, None, True, True))


def assert_lookups(values: list[np.ndarray], x: np.ndarray, y: np.ndarray) -> None:
    with own_settings():
        expected = jax.vmap(lambda *ray: lookups([*map(jnp.asarray, TABLES)], *ray))(x, y)
    assert_same(values, [np.asarray(leaf) for leaf in expected])


def test_rows_are_looked_up_by_indices_of_rays():
    x, y, _ = NUMBERS.T
    function = with_merged_divisions(lowered_lookups())
    assert function.tables == (("f8", 2), ("f4", 3), ("f2", 1))
    assert_lookups(leaves_of(function, evaluated(function, [], [x, y], tables=TABLES), len(x)), x, y)
    with pytest.raises(NotImplementedError, match="in doubles alone"):
        long_outputs(function, [], [0.5, 0.5])


@pytest.mark.slow
def test_kernels_look_up_rows(libraries):
    """In tables of all kinds; an index that is no number is that of a row too."""
    x, y, _ = NUMBERS.T
    function = lowered_lookups()
    outputs = [["f", list(shape.shape)] for shape in function.shapes]
    about = {"by_ray": [None] * 3 + [True] * 2, "tables": function.tables, "outputs": outputs}
    about["tree"] = ["tuple", [], [*range(len(outputs))]]
    results = [Kernel(library.lookups, about)(TABLES, x, y) for library in libraries.values()]
    assert_lookups(results[0], x, y)
    assert [leaf.tobytes() for leaf in results[0]] == [leaf.tobytes() for leaf in results[1]]
    kernel = Kernel(libraries[4].lookups, about)
    last = [table[-1] for table in TABLES]
    for index, rows in ((NAN, [table[0] for table in TABLES]), (-INF, [table[0] for table in TABLES]), (INF, last)):
        for row, one in zip(rows, kernel(TABLES, np.full(5, index), np.zeros(5)), strict=False):
            np.testing.assert_array_equal(one, np.broadcast_to(row, one.shape))
    with pytest.raises(ValueError, match="reads tables"):
        kernel([TABLES[0], TABLES[1], TABLES[2].T], x, y)


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """The kernels of all samples, with and without merged divisions, for one lane and for four."""
    folder = tmp_path_factory.mktemp("kernels")
    texts = [
        '#include "functions.h"\n#include "tables.h"\n',
        emitted(with_merged_divisions(lowered_lookups()), "lookups"),
    ]
    for name in SAMPLES:
        function = lowered_sample(name)
        texts += [emitted(function, name), emitted(with_merged_divisions(function), f"{name}_merged")]
    (folder / "samples.cc").write_text("\n".join(texts), encoding="utf-8")
    platform = platform_here()
    files = {lanes: folder / f"lanes{lanes}.so" for lanes in LANES}
    for lanes, file in files.items():
        build_library(folder / "samples.cc", file, platform, levels_for(platform)[0], lanes)
    return {lanes: ctypes.CDLL(str(file)) for lanes, file in files.items()}


def called(library: ctypes.CDLL, name: str, kernel: str) -> list[np.ndarray]:
    """The leaves of a sample's result by a kernel."""
    function, rays = lowered_sample(name), SAMPLES[name][1]
    # Whole numbers are written as bytes.
    types = [np.int8 if np.issubdtype(leaf.dtype, np.integer) else leaf.dtype for leaf in function.shapes]
    results = [np.empty((len(rays), *leaf.shape), dtype) for leaf, dtype in zip(function.shapes, types, strict=True)]
    getattr(library, kernel)(None, slots([rays]), slots(results), ctypes.c_int64(len(rays)))
    return results


@pytest.mark.parametrize("name", SAMPLES)
def test_kernels_are_the_functions(libraries, name):
    for kernel in (name, f"{name}_merged"):
        one, four = (called(libraries[lanes], name, kernel) for lanes in LANES)
        assert_same(four, by_jax(name))
        for alone, together in zip(one, four, strict=True):
            # To the bit, but for those of NaN.
            bits = [np.where(np.isnan(leaf), NAN, leaf).tobytes() for leaf in (alone, together)]
            assert bits[0] == bits[1]


def test_numbers_of_the_call_are_computed_before_the_loop():
    """And a sine and a cosine of one angle by one function."""
    function = lowered(lambda p, x: (jnp.sin(p * x), jnp.cos(p * x) * jnp.sqrt(p)), (1.0, 1.0), (False, True))
    before, _, within = emitted(function, "kernel").partition("for (int64_t i")
    assert ("sqrt_" in before, "sqrt_" in within, within.count("sincos_")) == (True, False, 1)
