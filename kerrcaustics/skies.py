"""Skies behind the hole: pictures, star fields and catalogues.

The names stand in the stub file beside this one, and are loaded when they are first used.
"""

from kerrcaustics.lazy_names import attached

__getattr__, __dir__, __all__ = attached(__name__, __file__)
