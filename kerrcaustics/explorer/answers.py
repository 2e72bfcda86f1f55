"""Questions of the page and answers to them, for the server and for notebooks.

Answers are views, which `page_data` makes, an orbit of the camera for the page to play, and pictures behind the curves.
"""

import json
import math
import time
from functools import lru_cache
from io import BytesIO
from typing import Any

import numpy as np
from jaxtyping import Float
from PIL import Image

from kerrcaustics.explorer.page_data import QUALITIES, Message, curves_of, finite, view_of
from kerrcaustics.explorer.state import PRESETS, ExplorerState
from kerrcaustics.images.images import StarImages
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.scenes.checkerboard import Checkerboard
from kerrcaustics.scenes.render import celestial_picture, trace_view
from kerrcaustics.scenes.sky_light import Sky
from kerrcaustics.scenes.star_field import StarField
from kerrcaustics.scenes.tones import tone_mapped
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge
from kerrcaustics.tracks.events import PairEvent
from kerrcaustics.tracks.tracks import Track, star_tracks

Array = np.ndarray

LONGEST_QUESTION = 4096
"""Bytes of a question at most."""

WANTS = (*QUALITIES, "orbit", "backdrop")

MOMENTS = 360
"""Moments of an orbit."""
# Most points of a track that the page is given.
_MOST_POINTS = 1500

SIZE, LARGEST_FIELD = 800, 250.0
"""Rows and columns of the camera's picture, and its field at most, degrees: its corners lie nearly behind."""
# The field of a broad panel, by the farthest point of the primary critical curve from the middle.
_ROOM = 4.2
_EDGE, _CELESTIAL = 240, 360


def greeting() -> Message:
    """The first message to the page: the state to begin with, if its address has none, and the presets."""
    presets = [{"name": name, "state": state.record()} for name, state in PRESETS.items()]
    return Message({"kind": "greeting", "state": ExplorerState().record(), "presets": presets}, {})


def question(text: str) -> tuple[int, str, ExplorerState]:
    """Number, want and state of a question {"id", "want", "state"}, or a ValueError."""
    if len(text) > LONGEST_QUESTION:
        raise ValueError(f"Argument `question` must have at most {LONGEST_QUESTION} characters, but has {len(text)}.")
    try:
        values = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise ValueError("Argument `question` must be JSON.") from None
    if not isinstance(values, dict) or not isinstance(values.get("state"), dict):
        raise ValueError('Argument `question` must have the keys "id", "want" and "state".')
    number, want = values.get("id"), values.get("want")
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < 2**53:
        raise ValueError("Argument `id` must be a whole number.")
    if want not in WANTS:
        raise ValueError(f"Argument `want` must be one of {', '.join(WANTS)}, but is {str(want)[:20]!r}.")
    return number, want, ExplorerState.of(values["state"])


def answer(number: int, want: str, state: ExplorerState) -> Message:
    """The answer to a question, or the reason why there is none."""
    makers = {"orbit": orbit_of, "backdrop": backdrop_of}
    try:
        message = makers[want](state) if want in makers else view_of(state, want)
    except ValueError as error:
        return refusal(str(error), number, want)
    return Message({**message.record, "id": number, "want": want}, message.arrays)


def refusal(line: str, number: int | None = None, want: str | None = None) -> Message:
    """The message that there is no answer, and why."""
    return Message({"kind": "refusal", "line": line, "id": number, "want": want}, {})


def _no_constant(constant: str) -> Any:
    raise ValueError(constant)


@usual_warnings
def orbit_of(state: ExplorerState, moments: int = MOMENTS) -> Message:
    """Tracks, events and images of the state's star over one orbit of its camera.

    The star's place in longitude does not matter: it passes through all. Moment i is the time i / moments of the
    period, when the star is at phi' = "phi" of it, relative to the camera.
    """
    began = time.perf_counter()
    state.check()
    star = star_tracks(state.camera(), math.radians(state.theta), state.max_index)
    times = star.period * np.arange(moments) / moments
    phi = np.degrees(star.azimuth_at(times)) % 360
    images = star.images_at(times)
    arrays = {"phi": phi, **_frames(images if isinstance(images, tuple) else (images,))}
    for i, track in enumerate(star.tracks):
        arrays |= _curve(i, track, star.angular_velocity, star.period)
    record = {
        "kind": "orbit",
        "state": state.record(),
        "period": star.period,
        "tracks": [{"closed": track.closed, "error": math.degrees(track.error.max())} for track in star.tracks],
        "events": [_event(event, star.period) for event in (*star.events, *star.ends)],
        "certified": star.certified,
        "remarks": list(star.remarks),
        "seconds": time.perf_counter() - began,
    }
    return Message(record, arrays)


def _frames(images: tuple[StarImages, ...]) -> dict[str, Array]:
    """Images of all moments after each other; first: the place of the first image of each moment, and the end."""
    number = np.concatenate([[0], np.cumsum([len(image) for image in images])])
    rows = [np.stack([i.index, i.magnification, np.degrees(i.error)], axis=-1) for i in images]
    return {
        "first": number.astype(float),
        "frame_sky": np.concatenate([image.sky for image in images]),
        "frame_numbers": np.concatenate(rows),
        "frame_certified": np.array([float(image.certified) for image in images]),
    }


def _curve(i: int, track: Track, angular_velocity: float, period: float) -> dict[str, Array]:
    """A track on the sky, and its brightness: part of the orbit, magnification, index."""
    step = -(-len(track) // _MOST_POINTS)
    moment = (-track.azimuth / angular_velocity / period)[::step]
    # At an event the images are as bright as one likes: the strip ends there.
    bright = np.where(np.isfinite(track.magnification), track.magnification, 0.0)[::step]
    return {f"track{i}": track.sky[::step], f"light{i}": np.stack([moment, bright, track.index[::step]], axis=-1)}


def _event(event: PairEvent, period: float) -> dict[str, object]:
    return {
        "kind": event.kind,
        "order": event.order,
        "part": event.moment / period,
        "phi": math.degrees(event.star[1]),
        "sky": event.sky.tolist(),
        "error": finite(np.degrees([event.error]))[0],
        "at_cusp": event.at_cusp,
    }


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
    return _jpeg(celestial_picture(sky, _CELESTIAL, mirror=True), name) if sky is not None else np.empty(0, np.uint8)


def _jpeg(light: Float[Array, "h w 3"], name: str) -> Array:
    if name == "stars":
        pixels = tone_mapped(light, exposure=1 / 2500, curve="asinh", softening=25)
    else:
        pixels = tone_mapped(light, exposure=1.0)
    file = BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=85)
    return np.frombuffer(file.getvalue(), np.uint8)
