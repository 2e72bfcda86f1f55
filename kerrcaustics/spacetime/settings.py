"""The settings of JAX under which the package computes, independent of those of the calling program.

They hold for the computing thread and during a call alone. No import and no call leaves a setting changed, with one
exception: functions that are compiled name a folder for their programs (beams/program_cache.py).
"""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import jax

# Of JAX: 64 bits; programs that are compiled, and may hold NaN; NumPy's rules for types and shapes; NumPy's arrays as
# arguments; the first device. Each with the function that sets it for a thread.
_JAX = {
    "jax_enable_x64": (jax.enable_x64, True),
    "jax_debug_nans": (jax.debug_nans, False),
    "jax_debug_infs": (jax.debug_infs, False),
    "jax_disable_jit": (jax.disable_jit, False),
    "jax_no_tracing": (jax.no_tracing, False),
    "jax_no_execution": (jax.no_execution, False),
    "jax_check_tracer_leaks": (jax.check_tracer_leaks, False),
    "jax_numpy_dtype_promotion": (jax.numpy_dtype_promotion, "standard"),
    "jax_numpy_rank_promotion": (jax.numpy_rank_promotion, "allow"),
    "jax_default_matmul_precision": (jax.default_matmul_precision, None),
    "jax_default_device": (jax.default_device, None),
    "jax_transfer_guard_host_to_device": (jax.transfer_guard_host_to_device, "allow"),
    "jax_transfer_guard_device_to_host": (jax.transfer_guard_device_to_host, "allow"),
    "jax_transfer_guard_device_to_device": (jax.transfer_guard_device_to_device, "allow"),
}
# Values of a guard that mean "allow".
_UNGUARDED = (None, "allow")


@contextmanager
def own_settings() -> Iterator[None]:
    """The settings of JAX for compiled code, and to make it; also within a user's own `jax.jit`.

    As a decorator too. If the user's settings are these already, it costs next to nothing.
    """
    with jax.ensure_compile_time_eval(), settings_of_programs():
        yield


@contextmanager
def settings_of_programs() -> Iterator[None]:
    """The same where a program is made but not called: its constants become part of it."""
    with ExitStack() as changed:
        for name, (setting, required) in _JAX.items():
            current = getattr(jax.config, name)
            if current != required and not (current in _UNGUARDED and required in _UNGUARDED):
                changed.enter_context(setting(required))
        yield
