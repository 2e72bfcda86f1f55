"""Brightness of the images on tracks, in time and by the azimuth of the source."""

import math
from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, MultipleLocator

from kerrcaustics.draw import style
from kerrcaustics.draw.projection import TURNS
from kerrcaustics.draw.tracks import all_events, index_line, stretches
from kerrcaustics.images.images import StarImages
from kerrcaustics.numerics.matching import best_matches
from kerrcaustics.results.units import magnification_unit
from kerrcaustics.shapes import Float
from kerrcaustics.tracks.events import PairEvent
from kerrcaustics.tracks.tracks import StarTracks

Array = np.ndarray

# Moments between two events, crowded where images run together; nearer than this part of the time in between, none.
_MOMENTS, _NEAREST = 100, 1e-10
# Least upper end of the axis of magnification: as an event has no bound, what is brighter is cut off.
_BRIGHTEST = 30.0
# Upper end of the axis against time, over the median magnification of the brightest image between two events.
_ABOVE_USUAL = 10.0
# Upper end of the axis against azimuth, over the median magnification of the brightest piece of a track.
_ABOVE_PIECE = 30.0


def brightness(ax: Axes, tracks: StarTracks, start: float, end: float) -> Axes:
    """Magnification of every image against coordinate time, logarithmic; verticals are the events.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    tracks : StarTracks
        Its star is in line with the camera at time 0.
    start, end : float
        First and last time, units of M.
    """
    events = _events_between(tracks, start, end)
    faintest = brightest = _BRIGHTEST
    for first, last in pairwise([start, *(time for time, _ in events), end]):
        if last <= first:
            continue
        for strand in _draw_strands(ax, tracks, first, last):
            faintest = min(faintest, float(np.nanmin(strand)))
            brightest = max(brightest, _ABOVE_USUAL * float(np.nanmedian(strand)))
    _event_verticals(ax, events)
    style.log_axis(ax, faintest / 2, brightest, ticks=7)
    ax.set(xlim=(start, end), xlabel="coordinate time (M)", ylabel=_magnification_name(tracks))
    ax.xaxis.set_major_locator(MaxNLocator(6))
    return ax


def brightness_by_azimuth(ax: Axes, tracks: StarTracks) -> Axes:
    """Magnification of every image against the azimuth of the source, degrees; verticals are the events."""
    usual = [1e-300]
    for track in tracks.tracks:
        azimuth = np.degrees(track.azimuth)
        for index, which in stretches(track):
            magnification = track.magnification[which]
            usual.append(float(np.median(magnification)))
            # Over the end of a closed track the azimuth jumps back by its turns.
            phi = azimuth[which] + 360 * track.turns * np.append(0, np.cumsum(np.diff(which) < 0))
            for turn in (-720, *TURNS, 720):
                ax.plot(phi - 360 * np.floor(phi.min() / 360) + turn, magnification, **index_line(index))
    _event_verticals(ax, [(math.degrees(event.star[1]), event) for event in all_events(tracks)])
    ax.set(yscale="log", xlim=(0, 360), xlabel="azimuth of the source (deg)", ylabel=_magnification_name(tracks))
    ax.set_ylim(top=_ABOVE_PIECE * max(usual))
    ax.xaxis.set_major_locator(MultipleLocator(90))
    return ax


def _magnification_name(tracks: StarTracks) -> str:
    unit = magnification_unit(tracks).replace("^2", "²")
    return f"magnification ({unit})" if unit else "magnification"


def _event_verticals(ax: Axes, events: Iterable[tuple[float, PairEvent]]) -> None:
    """A vertical line at each event, with its mark at the top."""
    for place, event in events:
        ax.axvline(place, color=style.GUIDE_COLOUR, linewidth=0.6, zorder=0.5)
        mark = style.event_mark(event.kind)
        ax.plot([place], [1.0], transform=ax.get_xaxis_transform(), clip_on=False, **mark)


def _draw_strands(ax: Axes, tracks: StarTracks, first: float, last: float) -> Iterator[Float[Array, " n"]]:
    """The magnifications of all images, drawn between two times without an event in between."""
    # Crowded toward both ends, where a pair is as bright as the time from its event is short to the power -1/2.
    part = 0.5 - 0.5 * np.cos(np.linspace(0, math.pi, _MOMENTS))
    times = first + (last - first) * np.clip(part**2 * (3 - 2 * part), _NEAREST, 1 - _NEAREST)
    images = tracks.images_at(times)
    assert isinstance(images, tuple)
    for index in range(tracks.max_index + 1):
        # A pair has one brightness near its event: the odd one of the two shows behind the other.
        behind = {"linewidth": 2.0, "zorder": 1.8} if index % 2 else {}
        for strand in _strands(images, index):
            ax.plot(times, strand, **{**index_line(index), **behind})
            yield strand


def _events_between(tracks: StarTracks, start: float, end: float) -> list[tuple[float, PairEvent]]:
    """Events with start < time < end, in the order of time, period after period."""
    moments = []
    for event in all_events(tracks):
        first = math.floor((start - event.moment) / tracks.period) + 1
        last = math.ceil((end - event.moment) / tracks.period)
        moments += [(event.moment + turn * tracks.period, event) for turn in range(first, last)]
    return sorted(moments, key=lambda pair: pair[0])


def _strands(images: tuple[StarImages, ...], index: int) -> Iterator[Float[Array, " n"]]:
    """Magnifications (n,) in time of each image of an index, between events, where their number stays the same.

    An image is the one nearest on the camera sky a moment before; where one is missed, the lines are broken.
    """
    # Within the error of an event the pair may be there or not: what most moments show counts.
    usual = int(np.median([image.per_index[index] for image in images]))
    strands, before = np.full((len(images), usual), np.nan), None
    for i, image in enumerate(images):
        which = np.flatnonzero(image.index == index)
        if len(which) != usual or usual == 0:
            before = None
            continue
        sky = image.sky[which]
        if before is not None:
            gap = ((before[:, None] - sky[None]) ** 2).sum(axis=2)
            chosen = best_matches(gap)[1]
            which, sky = which[chosen], sky[chosen]
        strands[i], before = image.magnification[which], sky
    yield from strands.T
