"""The stage set: the Kerr metric, cameras, photon constants, the shadow. No rays yet.

Importing this stage sets JAX up for the whole package, here and nowhere else: double precision, and a
compilation cache in the user's cache folder, so that a second run starts without compiling.
"""

import os
from pathlib import Path

import jax


def _cache_folder() -> Path:
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "kerrcaustics" / "xla"


if getattr(jax.config, "jax_compilation_cache_dir", None) is None:
    jax.config.update("jax_compilation_cache_dir", str(_cache_folder()))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)
