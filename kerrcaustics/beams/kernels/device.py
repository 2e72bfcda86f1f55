"""Kernels on a GPU: the graph that becomes machine code for a processor is one program there, a thread for each ray.

JAX compiles it (Pallas, by way of Triton). On a machine without a GPU it interprets it, for tests.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.experimental import pallas
from jax.experimental.pallas import triton

from kerrcaustics.beams.accelerator import compiler_options
from kerrcaustics.beams.kernels.divisions import with_merged_divisions
from kerrcaustics.beams.kernels.elementwise import FLAG, REAL
from kerrcaustics.beams.kernels.evaluation import Arithmetic, evaluated
from kerrcaustics.beams.kernels.lowering import Lowered
from kerrcaustics.beams.kernels.programs import graph_of
from kerrcaustics.spacetime.settings import own_settings, settings_of_programs

FEWEST = 1 << 16
"""The least number of rays that a program is made for; calls of fewer are filled up."""

# Sizes of programs differ by this factor: each is compiled by itself.
_NEXT = 4
# Rays of one block, a thread for each.
_BLOCK, _THREADS_OF_WARP = 128, 32


def _signed(size: Any, sign: Any) -> Any:
    negative = lax.lt(lax.bitcast_convert_type(sign, jnp.int64), jnp.int64(0))
    return jnp.where(negative, -jnp.abs(size), jnp.abs(size))


def _rounded(x: Any) -> Any:
    # Not by the sum with a large number and the difference, which compilers leave out.
    below = jnp.floor(x)
    part, odd = x - below, below != 2 * jnp.floor(below / 2)
    nearest = jnp.where((part > 0.5) | ((part == 0.5) & odd), below + 1, below)
    return jnp.where(lax.is_finite(x), _signed(nearest, x), x)


def _any(flags: Any) -> Any:
    # Triton has no reduction of flags.
    return jnp.max(flags.astype(jnp.int32)) > 0


def _block_of(value: float | bool) -> Any:
    return jnp.full((_BLOCK,), value, bool if isinstance(value, bool) else float)


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": lax.add,
    "sub": lax.sub,
    "mul": lax.mul,
    "div": lax.div,
    "neg": lax.neg,
    "sqrt": lax.sqrt,
    "abs": lax.abs,
    # A GPU's own lose NaN.
    "max": lambda a, b: jnp.where((a >= b) | (a != a), a, b),
    "min": lambda a, b: jnp.where((a <= b) | (a != a), a, b),
    "floor": lax.floor,
    "rint": _rounded,
    "rem": lax.rem,
    "sign": lax.sign,
    "copysign": _signed,
    "finite": lax.is_finite,
    "lt": lax.lt,
    "gt": lax.gt,
    "le": lax.le,
    "ge": lax.ge,
    "eq": lax.eq,
    "ne": lax.ne,
    "and": lax.bitwise_and,
    "or": lax.bitwise_or,
    "xor": lax.bitwise_xor,
    "not": lax.bitwise_not,
    "real": lambda flag: flag.astype(float),
    "select": jnp.where,
    "cbrt": lax.cbrt,
    "exp": lax.exp,
    "log": lax.log,
    "log1p": lax.log1p,
    "sin": lax.sin,
    "cos": lax.cos,
    "atan": lax.atan,
    "atan2": lax.atan2,
}
_BLOCKS = Arithmetic(_OPERATIONS, _block_of, _any, lax.while_loop)


class DeviceKernel:
    """A function of rays on a GPU, called as a kernel is (`library.Kernel`)."""

    def __init__(self, name: str) -> None:
        self._function = with_merged_divisions(graph_of(name)[0])
        if self._function.tables:
            raise NotImplementedError(f"There is no program of a GPU for {name}, which looks up numbers in tables.")
        self._programs: dict[int, Callable[..., Any]] = {}

    def on_rays(self, numbers: Sequence[float], columns: Sequence[np.ndarray]) -> Any:
        """The values for the numbers of the call and the columns of rays, (n,) or several in one array (n, k)."""
        count, size = len(columns[0]), FEWEST
        while size < count:
            size *= _NEXT
        single = [column for given in columns for column in (given.T if given.ndim == 2 else [given])]
        padded = [np.resize(np.asarray(column, float), size) for column in single]
        program = self._program(size)
        with own_settings():
            outputs = jax.device_get(program(_of_call(numbers), *padded))
        return self._result([values[:count] for values in outputs])

    def _program(self, rays: int) -> Callable[..., Any]:
        if rays not in self._programs:
            self._programs[rays] = compiled(self._function, rays)
        return self._programs[rays]

    def _result(self, outputs: list[np.ndarray]) -> Any:
        """Outputs as the function returns them."""
        leaves = []
        for leaf, shape in enumerate(self._function.shapes):
            parts = [v for v, about in zip(outputs, self._function.outputs, strict=True) if about.leaf == leaf]
            values = np.stack(parts, axis=-1).reshape(-1, *shape.shape)
            leaves.append(values.view(bool) if shape.dtype == bool else values)
        return jax.tree.unflatten(self._function.tree, leaves)


def _of_call(numbers: Iterable[float]) -> np.ndarray:
    """The numbers of a call, and one more: there is at least one."""
    return np.array([*numbers, 0.0], float)


def compiled(function: Lowered, rays: int) -> Callable[..., Any]:
    """A function as a program for so many rays, a multiple of a block."""
    with settings_of_programs():
        program = jax.jit(program_of(function, rays), compiler_options=compiler_options())
        return program.lower(*arguments_of(function, rays)).compile()


def arguments_of(function: Lowered, rays: int) -> list[jax.ShapeDtypeStruct]:
    """Shapes of the arguments of such a program: the numbers of a call, with one more; a column each."""
    numbers = _of_call(range(function.parameters)).shape
    return [jax.ShapeDtypeStruct(shape, float) for shape in (numbers, *[(rays,)] * function.columns)]


def program_of(function: Lowered, rays: int) -> Callable[..., Any]:
    """A function of `arguments_of` to columns of its outputs: reals, and whole numbers of 8 bits."""

    def block(numbers: Any, *columns_and_outputs: Any) -> None:
        columns, outputs = columns_and_outputs[: function.columns], columns_and_outputs[function.columns :]
        of_call = [jnp.broadcast_to(numbers[i], (_BLOCK,)) for i in range(function.parameters)]
        results = evaluated(function, of_call, [column[...] for column in columns], _BLOCKS)
        for output, values in zip(outputs, results, strict=True):
            output[...] = values.astype(output.dtype)

    kinds = {REAL: jnp.float64, FLAG: jnp.int8}
    types = [jax.ShapeDtypeStruct((rays,), kinds.get(output.kind, jnp.int8)) for output in function.outputs]
    own = pallas.BlockSpec((_BLOCK,), lambda i: (i,))
    whole = pallas.BlockSpec((function.parameters + 1,), lambda i: (0,))
    return pallas.pallas_call(
        block,
        out_shape=types,
        grid=(rays // _BLOCK,),
        in_specs=[whole, *[own] * function.columns],
        out_specs=[own] * len(types),
        interpret=jax.default_backend() == "cpu",
        compiler_params=triton.CompilerParams(num_warps=_BLOCK // _THREADS_OF_WARP),
    )


@cache
def device_kernel(name: str) -> DeviceKernel:
    """The kernel of that name on the GPU."""
    return DeviceKernel(name)
