"""Questions of the page and answers to them, for the server and for notebooks.

Answers are views, which `page_data` makes, an orbit of the camera for the page to play, the images of a star of finite
size, its waves, and pictures of `backdrops`.
"""

import json
import math
import time
from typing import Any

import numpy as np

from kerrcaustics.explorer.backdrops import Window, backdrop_of, checked_window
from kerrcaustics.explorer.lessons import lessons
from kerrcaustics.explorer.limits import allowed, nearest
from kerrcaustics.explorer.page_data import QUALITIES, Message, finite, view_of
from kerrcaustics.explorer.state import LEAST_FREQUENCY, MOST_FREQUENCY, PRESETS, ExplorerState
from kerrcaustics.extended_sources.magnification import magnification
from kerrcaustics.images.images import StarImages
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.results.stages import stage
from kerrcaustics.tracks.events import PairEvent
from kerrcaustics.tracks.tracks import Track, star_tracks
from kerrcaustics.waves.amplification import amplification

Array = np.ndarray

LONGEST_QUESTION = 4096
"""Bytes of a question at most."""

WANTS = (*QUALITIES, "orbit", "shapes", "waves", "backdrop")

MOMENTS = 360
"""Moments of an orbit."""
# Frequencies of a spectrum on both sides of the one that is asked for, and the largest part of that they reach.
_FREQUENCIES, _REACH = 200, 10.0
# Most points of a track or a limb that the page is given.
_MOST_POINTS = 1500


class NoState(ValueError):
    """A question whose state cannot be, with its number and want."""

    def __init__(self, line: str, number: int, want: str) -> None:
        """Keep what the refusal needs."""
        super().__init__(line)
        self.number, self.want = number, want


def greeting(*, lasting: bool = False) -> Message:
    """The first message to the page: the state to begin with, what is allowed, presets, lessons and terms.

    lasting: True if the program has the same address at every start.
    """
    presets = [{"name": name, "state": state.record()} for name, state in PRESETS.items()]
    usual = ExplorerState()
    record = {
        "kind": "greeting",
        "state": usual.record(),
        "allowed": allowed(usual),
        "presets": presets,
        "lasting": lasting,
    }
    return Message({**record, **lessons()}, {})


Question = tuple[int, str, ExplorerState, Window | None]


def question(text: str) -> Question:
    """Number, want, state and window of a question {"id", "want", "state"}, or a ValueError.

    A backdrop may have a "window" beside these: its middle, to the right of the shadow's and above, and its side,
    degrees.

    The state is the nearest one that there is: a camera too near to the hole is moved out, and one that cannot have its
    velocity is fiducial.
    """
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
    try:
        window = checked_window(values.get("window"))
        state = nearest(ExplorerState.read(values["state"]))
        state.check()
    except ValueError as error:
        raise NoState(str(error), number, want) from None
    return number, want, state, window


def answer(number: int, want: str, state: ExplorerState, window: Window | None = None) -> Message:
    """The answer to a question, or the reason why there is none."""
    makers = {
        "orbit": orbit_of,
        "shapes": shapes_of,
        "waves": waves_of,
        "backdrop": lambda state: backdrop_of(state, window),
    }
    try:
        message = makers[want](state) if want in makers else view_of(state, want)
    except ValueError as error:
        return refusal(error, number, want)
    return Message({**message.record, "id": number, "want": want}, message.arrays)


def refusal(reason: ValueError | str, number: int | None = None, want: str | None = None) -> Message:
    """The message that there is no answer, and why."""
    if isinstance(reason, NoState):
        number, want = reason.number, reason.want
    return Message({"kind": "refusal", "line": str(reason), "id": number, "want": want}, {})


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
    with stage("tracks_of_the_images"):
        star = star_tracks(state.camera(), math.radians(state.theta), state.max_index)
    times = star.period * np.arange(moments) / moments
    phi = np.degrees(star.azimuth_at(times)) % 360
    with stage("images_along_the_orbit"):
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


@usual_warnings
def shapes_of(state: ExplorerState) -> Message:
    """The images of the limb of the state's star, which has a size, and its magnification."""
    began = time.perf_counter()
    state.check()
    if state.size == 0:
        raise ValueError("Argument `size` must be the radius of a star, but is 0.")
    with stage("images_of_the_limb"):
        result = magnification(state.camera(), state.star(), math.radians(state.size), max_index=state.max_index)
    arrays = {}
    for i, image in enumerate(result.images):
        step = -(-len(image.sky) // _MOST_POINTS)
        arrays[f"limb{i}"] = np.concatenate([image.sky, image.index[:, None]], axis=1)[::step]
    record = {
        "kind": "shapes",
        "state": state.record(),
        "total": result.total,
        "error": result.error,
        "per_index": list(result.per_index.values()),
        "certified": result.certified,
        "remarks": list(result.remarks),
        "seconds": time.perf_counter() - began,
    }
    return Message(record, arrays)


@usual_warnings
def waves_of(state: ExplorerState) -> Message:
    """The waves of the state's star, at the state's frequency and beside it."""
    began = time.perf_counter()
    state.check()
    if state.frequency == 0:
        raise ValueError("Argument `frequency` must be that of waves, but is 0.")
    low, high = max(state.frequency / _REACH, LEAST_FREQUENCY), min(state.frequency * _REACH, MOST_FREQUENCY)
    frequencies = np.append(np.geomspace(low, high, 2 * _FREQUENCIES), state.frequency)
    with stage("waves_of_the_star"):
        result = amplification(state.camera(), state.star(), frequencies, max_index=state.max_index)
    modulus = np.abs(result.value)
    record = {
        "kind": "waves",
        "state": state.record(),
        "frequency": state.frequency,
        "modulus": modulus[-1],
        "error": result.error[-1],
        "method": str(result.method[-1]),
        "sum": float(np.sqrt((result.image_amplitude[result.image_index <= state.max_index] ** 2).sum())),
        "certified": result.certified,
        "remarks": list(result.remarks),
        "seconds": time.perf_counter() - began,
    }
    return Message(record, {"spectrum": np.stack([frequencies, modulus, result.error], axis=-1)[:-1]})


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
