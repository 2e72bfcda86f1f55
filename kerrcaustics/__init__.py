"""Caustics and critical curves of a spinning (Kerr) black hole, on the sky of a camera near it.

>>> import kerrcaustics as kc
>>> camera = kc.Camera(spin=0.999, radius=6.03)
>>> primary, secondary, tertiary = kc.caustics(camera, orders=3)

Units G = c = M = 1, angles in radians. Names are loaded when they are first used.
"""

from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kerrcaustics.beams.beam import Beams as Beams, Rays as Rays, Status as Status
    from kerrcaustics.beams.ends import EquatorialPlane as EquatorialPlane
    from kerrcaustics.beams.trace import trace_beams as trace_beams, trace_rays as trace_rays
    from kerrcaustics.curves.caustic import (
        Caustic as Caustic,
        CausticSet as CausticSet,
        Cusp as Cusp,
        caustics as caustics,
    )
    from kerrcaustics.curves.store import (
        load_caustics as load_caustics,
        save_caustics as save_caustics,
        to_xarray as to_xarray,
    )
    from kerrcaustics.spacetime.camera import Camera as Camera
    from kerrcaustics.spacetime.shadow import shadow_edge as shadow_edge
    from kerrcaustics.spacetime.sphere import tangent_basis as tangent_basis

_HOMES = {
    "Beams": "beams.beam",
    "Camera": "spacetime.camera",
    "Caustic": "curves.caustic",
    "CausticSet": "curves.caustic",
    "Cusp": "curves.caustic",
    "EquatorialPlane": "beams.ends",
    "Rays": "beams.beam",
    "Status": "beams.beam",
    "caustics": "curves.caustic",
    "load_caustics": "curves.store",
    "save_caustics": "curves.store",
    "shadow_edge": "spacetime.shadow",
    "tangent_basis": "spacetime.sphere",
    "to_xarray": "curves.store",
    "trace_beams": "beams.trace",
    "trace_rays": "beams.trace",
}

__all__ = [
    "Beams",
    "Camera",
    "Caustic",
    "CausticSet",
    "Cusp",
    "EquatorialPlane",
    "Rays",
    "Status",
    "caustics",
    "load_caustics",
    "save_caustics",
    "shadow_edge",
    "tangent_basis",
    "to_xarray",
    "trace_beams",
    "trace_rays",
]
__version__ = metadata.version("kerrcaustics")


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
