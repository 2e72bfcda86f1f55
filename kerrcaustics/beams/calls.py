"""Calls of the engines: one kernel for each request, or a GPU for many rays."""

from functools import lru_cache
from typing import Any

import numpy as np

from kerrcaustics.beams.accelerator import on_accelerator
from kerrcaustics.beams.ends import End, Sphere, Spherical
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.kernels.trees import leaves
from kerrcaustics.beams.ray_end import RayEnd, RayOutputs
from kerrcaustics.beams.spheres import Spheres
from kerrcaustics.spacetime.viewer import Viewer


def closed_form(
    camera: Viewer, sky: np.ndarray, end: End, outputs: RayOutputs, *, short: bool = False
) -> RayEnd[np.ndarray]:
    """The closed form of rays; short: by the formulas for small k. Beams have their index and crossings."""
    name = f"{'short_' if short else ''}{_request(outputs)}{'_equator' if camera.on_equator and not short else ''}"
    return _kernel_value(name, camera, [sky], end)


def prospects(camera: Viewer, sky: np.ndarray, end: End) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Flags of rays that do not reach their end, that fall in when followed on, and for which both are certain."""
    return _kernel_value("prospects", camera, [sky], end)


def work(camera: Viewer, sky: np.ndarray, end: End) -> np.ndarray:
    """An estimate of the work of the integrator on each ray."""
    return _kernel_value("survey", camera, [sky], end)


def integrate(
    camera: Viewer, sky: np.ndarray, refinement: np.ndarray, tolerance: float, end: End, outputs: RayOutputs
) -> RayEnd[np.ndarray]:
    """Rays integrated once, each with its steps shorter by its refinement; neighbours should be of similar work."""
    return _kernel_value(f"integrated_{_request(outputs)}", camera, [sky, refinement], end, tolerance).only(outputs)


def deep_ends(
    camera: Viewer, sky: np.ndarray, d: np.ndarray, end: Spherical, second_arrival: np.ndarray
) -> tuple[np.ndarray, ...]:
    """The values of closed_form/deep_rays.py for rays of d, at their first or at their second arrivals."""
    surface = Spheres(np.full(len(sky), end.radius), second_arrival) if isinstance(end, Sphere) else end
    return _kernel_value(f"deep{'_equator' if camera.on_equator else ''}", camera, [sky, d], surface)


def roots(
    camera: Viewer, columns: list[np.ndarray], end: End, numbers: tuple[float, ...], table: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Newton's method on the sky map, of lens_map/newton_formulas.py: directions, their errors, and states.

    Parameters: columns, the first guess (n, 3), the unit vector of the star (n, 3), and the Morse index; numbers and
    table, of the call.
    """
    name, columns, _ = _to_end(f"root{'_equator' if camera.on_equator else ''}", columns, end)
    return kernel(name).on_rays((*_numbers(camera), *numbers), columns, tables=[table])


def depth(camera: Viewer, sky: np.ndarray) -> np.ndarray:
    """The d of rays, the square of half the distance of the outer roots of R."""
    return _kernel("depth", len(sky)).on_rays(_numbers(camera), [sky])


def crossing_gap(camera: Viewer, sky: np.ndarray, crossing: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """The gap of Mino times of lens_map/crossing_formulas.py for rays (n, 3), each with its crossing and its radius."""
    return _kernel("crossing_gap", len(sky)).on_rays(_numbers(camera), [sky, crossing, radius])


def _request(outputs: RayOutputs) -> str:
    """The quantities beside n' in the name of a kernel."""
    return f"{'beams' if outputs.beams else 'rays'}{'_time' if outputs.time else ''}"


def _kernel_value(name: str, camera: Viewer, columns: list[np.ndarray], end: End, *numbers: float) -> Any:
    """The value of a kernel of rays to an end."""
    name, columns, numbers_of_end = _to_end(name, columns, end)
    return _kernel(name, len(columns[0])).on_rays((*_numbers(camera), *numbers, *numbers_of_end), columns)


def _to_end(name: str, columns: list[np.ndarray], end: End) -> tuple[str, list[np.ndarray], tuple[float, ...]]:
    """The name of a kernel, its columns with those of an end, and the numbers of the end that all rays share."""
    name = f"{name}_{end.kernel}"
    if not isinstance(end, Sphere):
        return name, columns, end.numbers()
    count = len(columns[0])
    return name, [*columns, *(np.broadcast_to(part, count).astype(float) for part in end.numbers())], ()


def _kernel(name: str, count: int) -> Any:
    """The kernel of that name, for so many rays."""
    if not on_accelerator(count):
        return kernel(name)
    from kerrcaustics.beams.kernels.device import device_kernel

    return device_kernel(name)


@lru_cache(maxsize=64)
def _numbers(camera: Viewer) -> tuple[float, ...]:
    """The numbers of the camera's frame."""
    return tuple(map(float, leaves(camera.frame())))
