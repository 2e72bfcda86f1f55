"""Caustics and critical curves of a spinning (Kerr) black hole, on the sky of a camera near it.

>>> import kerrcaustics as kc
>>> camera = kc.Camera(spin=0.999, radius=6.03)
>>> primary, secondary, tertiary = kc.caustics(camera, orders=3)

Units G = c = M = 1, angles in radians. The names stand in the stub file beside this one, and are loaded at their
first use.
"""

import os
import sys

# In a program (`python -m kerrcaustics`, or the script of that name) this code runs first: from here on Ctrl-C ends it
# with one line at any moment of loading. Processes that Python starts beside it are no programs.
if (sys.argv[:1] == ["-m"] and ("-m", "kerrcaustics") in zip(sys.orig_argv, sys.orig_argv[1:], strict=False)) or (
    [os.path.basename(name) for name in sys.orig_argv[1:2]] == ["kerrcaustics"]
):
    # Python has loaded it at its start. While it loads others, it swallows KeyboardInterrupt now and then.
    import _signal

    def _end(*_: object) -> None:
        sys.stderr.write("kerrcaustics: Interrupted: nothing was left half-written.\n")
        os._exit(130)

    _signal.signal(_signal.SIGINT, _end)

    from kerrcaustics.interrupts import on_interrupt as _on_interrupt

    _on_interrupt()

from typing import Any

from kerrcaustics.lazy_names import attached

_named, __dir__, __all__ = attached(__name__, __file__)


def __getattr__(name: str) -> Any:
    """A public name; or the version, which only an installed package has: a build runs this file before."""
    if name == "__version__":
        # Its reader takes longer to load than all else here.
        from importlib.metadata import version

        return version("kerrcaustics")
    return _named(name)
