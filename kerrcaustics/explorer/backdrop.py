"""Pictures behind the curves: the lensed sky as the camera sees it, and the sky itself."""

import math
import time
from functools import lru_cache
from io import BytesIO

import numpy as np
from jaxtyping import Float
from PIL import Image

from kerrcaustics.explorer.page_data import Message, curves_of
from kerrcaustics.explorer.state import ExplorerState
from kerrcaustics.scenes.checkerboard import Checkerboard
from kerrcaustics.scenes.colour import tone_mapped
from kerrcaustics.scenes.render import celestial_picture, trace_view
from kerrcaustics.scenes.sky_light import Sky
from kerrcaustics.scenes.star_field import StarField
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge

Array = np.ndarray

SIZE, LARGEST_FIELD = 800, 250.0
"""Rows and columns of the camera's picture, and its field at most, degrees: its corners lie nearly behind."""
# The field of a broad panel, by the farthest point of the primary critical curve from the middle.
_ROOM = 4.2
_EDGE, _CELESTIAL = 240, 360


def backdrop_of(state: ExplorerState) -> Message:
    """The lensed sky of a state, round the middle of the shadow, and the sky itself by phi' and theta': JPEG files."""
    began = time.perf_counter()
    state.check()
    sky = _sky(state.backdrop)
    field, arrays = 0.0, {}
    if sky is not None:
        field = _field(state)
        arrays = {"lensed": _lensed(state.camera(), state.backdrop, field), "celestial": _celestial(state.backdrop)}
    record = {"kind": "backdrop", "state": state.record(), "field": field, "seconds": time.perf_counter() - began}
    return Message(record, arrays)


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
def _lensed(camera: Camera, name: str, field: float) -> Array:
    forward, _, up = shadow_axes(camera, shadow_edge(camera, _EDGE))
    view = View(SIZE, SIZE, math.radians(field), "fisheye", forward, up)
    return _jpeg(trace_view(camera, view, quality="draft").show(_sky(name)).light, name)


@lru_cache(maxsize=3)
def _celestial(name: str) -> Array:
    sky = _sky(name)
    return _jpeg(celestial_picture(sky, _CELESTIAL), name) if sky is not None else np.empty(0, np.uint8)


def _jpeg(light: Float[Array, "h w 3"], name: str) -> Array:
    if name == "stars":
        pixels = tone_mapped(light, exposure=1 / 2500, curve="asinh", softening=25)
    else:
        pixels = tone_mapped(light)
    file = BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=85)
    return np.frombuffer(file.getvalue(), np.uint8)
