"""Skies behind the hole: pictures, star fields and catalogues.

The names stand in the stub file beside this one, and are loaded when they are first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub("kerrcaustics", __file__)
