"""Tracks of a source that circles in the equatorial plane, at one crossing.

Its images run along one closed curve, the image of the circle (circle_arcs.py). Two images meet at extremes of the
azimuth along that curve: an event. Tracks are the parts of the curve whose index is requested.
"""

import math

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.images.circle_arcs import Arcs, step_between
from kerrcaustics.images.circle_folds import node_errors
from kerrcaustics.lens_map.lens_map import LensMap
from kerrcaustics.lens_map.measured_light import MeasuredLight, measured_light
from kerrcaustics.shapes import Int
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.events import PairEvent
from kerrcaustics.tracks.track import Track

Array = np.ndarray

_TURN = 2 * math.pi


def arc_tracks(
    camera: Viewer, arcs: Arcs, events: dict[int, PairEvent], max_index: int, surface: End
) -> tuple[Track, ...]:
    """The image of a circle, as far as its index is at most max_index."""
    if not len(arcs.index):
        return ()
    lens_map = LensMap(camera, surface)
    light = lens_map.light_at(arcs.low.sky)
    measured = measured_light(lens_map, light, arcs.low.sky, node_errors(arcs, light.beams))
    chains = _chains(arcs.index <= max_index)
    tracks = [_track(lens_map, arcs, chain, events, measured) for chain in chains]
    return tuple(sorted(tracks, key=lambda track: (track.index.min(), not track.closed, len(track))))


def _chains(kept: Array) -> list[Int[Array, " _"]]:
    """Nodes of connected pieces: of the whole circle once, of others with the node at which each ends."""
    if kept.all():
        return [np.arange(len(kept))]
    starts = np.flatnonzero(kept & ~np.roll(kept, 1))
    stops = np.flatnonzero(~kept & np.roll(kept, 1))
    return [(i + np.arange(int(((stops - i) % len(kept)).min()) + 1)) % len(kept) for i in starts.tolist()]


def _track(
    lens_map: LensMap,
    arcs: Arcs,
    chain: Int[Array, " _"],
    events: dict[int, PairEvent],
    light: MeasuredLight,
) -> Track:
    """The track of a chain of nodes."""
    closed = len(chain) == len(arcs.index)
    low, folded = arcs.low[chain], arcs.folded[chain]
    steps = step_between(low, arcs.high[chain])
    index = np.where(folded, np.maximum(arcs.index, np.roll(arcs.index, 1))[chain], arcs.index[chain])
    places = np.flatnonzero(folded)
    return Track(
        camera=lens_map.viewer,
        surface=lens_map.surface,
        sky=light.sky[chain],
        azimuth=low.azimuth[0] + np.concatenate([[0], np.cumsum(steps[:-1])]),
        index=index,
        parity=np.where(folded, 0, 1 - 2 * (index % 2)),
        magnification=np.where(folded, np.inf, light.magnification[chain]),
        magnification_error=np.where(folded, np.inf, light.magnification_error[chain]),
        redshift=light.redshift[chain],
        redshift_error=light.redshift_error[chain],
        time=light.time[chain],
        time_error=light.time_error[chain],
        error=light.error[chain],
        closed=closed,
        turns=round(steps.sum() / _TURN) if closed else 0,
        events=tuple(events[i] for i in chain[places].tolist()),
        places=tuple(places.tolist()),
    )
