"""The choice of a GPU: many rays go there, to the kernels of kernels/device.py.

Nothing needs a GPU, and JAX is loaded when one is used.
"""

from functools import cache
from importlib.util import find_spec
from typing import Any

MOST_RAYS = 1 << 20
"""Rays in one call of a GPU; a call takes some 300 bytes for each there."""

# The fewest rays for which a GPU is used.
_WORTH = 1 << 16


def on_accelerator(count: int) -> bool:
    """True if so many rays go to a GPU: there is one, JAX can use it, and it pays."""
    return count >= _WORTH and name_of_device() is not None


@cache
def name_of_device() -> str | None:
    """The GPU that JAX can use, in words; None without one."""
    # Plug-ins of JAX for devices are parts of this package: without one JAX need not be loaded to know.
    if find_spec("jax_plugins") is None:
        return None
    import jax

    first = jax.devices()[0]
    return f"{first.platform}: {first.device_kind}" if first.platform == "gpu" else None


def compiler_options() -> dict[str, Any] | None:
    """Options with which XLA compiles formulas.

    On a CPU, one loop for each operation compiles in half the time, and runs faster: fused loops repeat what they
    share.
    """
    import jax

    return {"xla_disable_hlo_passes": "fusion,small-while-loop-hoisting"} if jax.default_backend() == "cpu" else None
