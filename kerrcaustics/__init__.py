"""Caustics and critical curves of a spinning (Kerr) black hole, on the sky of a camera near it.

>>> import kerrcaustics as kc
>>> camera = kc.Camera(spin=0.999, radius=6.03)
>>> primary, secondary, tertiary = kc.caustics(camera, orders=3)

Units G = c = M = 1, angles in radians. The names stand in the stub file beside this one, and are loaded when they are
first used.
"""

from importlib.metadata import version

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__version__ = version("kerrcaustics")
