"""Pictures behind the curves: the lensed sky round the middle of the shadow or a part of it, and the sky itself."""

import math
import time
from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

from kerrcaustics.explorer.page_data import Message, curves_of
from kerrcaustics.explorer.state import ExplorerState
from kerrcaustics.scenes.celestial_picture import celestial_picture
from kerrcaustics.scenes.checkerboard import Checkerboard
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.sky import Sky
from kerrcaustics.scenes.star_field import StarField
from kerrcaustics.scenes.tones import tone_mapped
from kerrcaustics.scenes.traced_view import trace_view
from kerrcaustics.scenes.view import View
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import real_number
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge

Array = np.ndarray

SIZE = 800
"""Rows and columns of the camera's picture."""

LEAST_FIELD, LARGEST_FIELD = 0.01, 250.0
"""Sides of it, degrees: the corners of the largest lie nearly behind the camera."""

Window = tuple[float, float, float]
"""Its middle, to the right of the middle of the shadow and above, and its side, degrees."""
# The side for a broad panel, by the farthest point of the primary critical curve from the middle.
_ROOM = 4.2
_EDGE, _CELESTIAL = 240, 360
# The projection ends behind the camera.
_FARTHEST = 179.0


@dataclass(frozen=True, eq=False)
class ViewPart(Raster):
    """A part of the projection of a view, in pixels of another size.

    width: columns of pixels.
    height: rows of pixels.
    whole: the view.
    middle: middle of the part, in pixels of the whole.
    step: pixels of the whole from one pixel to the next.
    """

    width: int
    height: int
    whole: View
    middle: tuple[float, float]
    step: float
    viewer: ClassVar[Any] = Camera

    @property
    def even(self) -> bool:
        """True if neighbouring pixels are of about one size everywhere."""
        return self.whole.even

    @property
    def pixel_angle(self) -> float:
        """Angle between directions of neighbouring pixels in the middle of the whole, radians."""
        return self.whole.pixel_angle * self.step

    def directions(self, x: ArrayLike, y: ArrayLike) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3 2"]]:
        """Directions (..., 3) of places in pixels, and their steps (..., 3, 2) per pixel along x and y."""
        sky, steps = self.whole.directions(*self._on_whole(x, y))
        return sky, steps * self.step

    def pixels(self, sky: ArrayLike) -> Float[Array, "*batch 2"]:
        """Places (..., 2) in pixels of directions (..., 3)."""
        return (self.whole.pixels(sky) - self.middle) / self.step + self._half

    def pixel_sizes(self, x: ArrayLike, y: ArrayLike) -> Float[Array, "*batch"]:
        """Solid angles (...,), steradian, of pixels at places of the picture."""
        return self.whole.pixel_sizes(*self._on_whole(x, y)) * self.step**2

    @property
    def _half(self) -> Array:
        return np.array([self.width - 1, self.height - 1]) / 2

    def _on_whole(self, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
        (across, down), (half_x, half_y) = self.middle, self._half
        return across + (np.asarray(x, float) - half_x) * self.step, down + (np.asarray(y, float) - half_y) * self.step


def backdrop_of(state: ExplorerState, window: Window | None = None) -> Message:
    """The lensed sky of a state in a window, and the sky itself by phi' and theta': JPEG files.

    window: left out, that of a panel which shows the primary critical curve.
    """
    began = time.perf_counter()
    state.check()
    arrays = {}
    if _sky(state.backdrop) is not None:
        window = window or (0.0, 0.0, _field(state))
        arrays = {"lensed": _lensed(state.camera(), state.backdrop, window), "celestial": _celestial(state.backdrop)}
    record = {"kind": "backdrop", "state": state.record(), "window": window}
    return Message({**record, "seconds": time.perf_counter() - began}, arrays)


def checked_window(value: Any) -> Window | None:
    """A window from outside; a ValueError unless it lies on the sky."""
    if value is None:
        return None
    numbers = [real_number("window", each) for each in value] if isinstance(value, list) else []
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise ValueError("Argument `window` must have three finite numbers.")
    across, up, field = numbers
    if not (LEAST_FIELD <= field <= LARGEST_FIELD and math.hypot(across, up) + field / math.sqrt(2) <= _FARTHEST):
        raise ValueError(f"Argument `window` must lie within {_FARTHEST:g} degrees of the middle of the shadow.")
    return across, up, field


def window_view(camera: Camera, window: Window) -> ViewPart:
    """The pixels of a window."""
    forward, _, up = shadow_axes(camera, shadow_edge(camera, _EDGE))
    whole = View(SIZE, SIZE, math.radians(LARGEST_FIELD), "fisheye", forward, up)
    across, above, field = (SIZE / LARGEST_FIELD * number for number in window)
    middle = (SIZE - 1) / 2
    return ViewPart(SIZE, SIZE, whole, (middle + across, middle - above), field / SIZE)


def _field(state: ExplorerState) -> float:
    camera, primary = state.camera(), next(iter(curves_of(state)), None)
    edge = shadow_edge(camera, _EDGE)
    curve = edge if primary is None else primary.sky
    farthest = np.arccos(np.clip(curve @ shadow_axes(camera, edge)[0], -1, 1)).max()
    return min(LARGEST_FIELD, _ROOM * math.degrees(farthest))


@lru_cache(maxsize=3)
def _sky(name: str) -> Sky | None:
    return {"none": lambda: None, "stars": StarField, "checkerboard": Checkerboard}[name]()


@lru_cache(maxsize=8)
def _lensed(camera: Camera, name: str, window: Window) -> Array:
    traced = trace_view(camera, window_view(camera, window), quality="draft")
    return _jpeg(traced.show(_sky(name)).light, name)


@lru_cache(maxsize=3)
def _celestial(name: str) -> Array:
    sky = _sky(name)
    return _jpeg(celestial_picture(sky, _CELESTIAL, mirror=True), name) if sky is not None else np.empty(0, np.uint8)


def _jpeg(light: Float[Array, "h w 3"], name: str) -> Array:
    if name == "stars":
        pixels = tone_mapped(light, exposure=1 / 2500, curve="asinh", softening=25)
    else:
        pixels = tone_mapped(light, exposure=1.0)
    file = BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=85)
    return np.frombuffer(file.getvalue(), np.uint8)
