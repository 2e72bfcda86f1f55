"""An orbit of the camera, for the page to play: tracks, pair events, and the images at many moments."""

import math
import time

import numpy as np

from kerrcaustics.explorer.page_data import Message, finite
from kerrcaustics.explorer.state import ExplorerState
from kerrcaustics.images.images import StarImages
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.tracks.events import PairEvent
from kerrcaustics.tracks.tracks import Track, star_tracks

Array = np.ndarray

MOMENTS = 360
"""Moments of an orbit."""
# Most points of a track that the page is given.
_MOST_POINTS = 1500


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
