"""Pictures of tracks: on the camera sky, unrolled at the shadow edge, and the brightness of their images."""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int, Real
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator, MultipleLocator, NullLocator
from scipy.optimize import linear_sum_assignment

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.plots import camera_in_words, headline
from kerrcaustics.draw.projection import (
    TURNS,
    axes_about,
    azimuthal_equidistant,
    unrolled,
    unrolled_curve,
    unrolled_places,
    view_axes,
)
from kerrcaustics.draw.sky_axes import camera_sky_axes, critical_line, level_in_words, unrolled_axes
from kerrcaustics.images.images import StarImages
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.tracks.events import PairEvent
from kerrcaustics.tracks.tracks import StarTracks, Track

Array = np.ndarray

_EDGE_POINTS = 2000
_CRITICAL: dict[str, Any] = {"color": "#9a9a9a", "linewidth": 0.7, "linestyle": (0, (3, 2))}
_ARROW: dict[str, Any] = {"arrowstyle": "-|>", "linewidth": 0, "shrinkA": 0, "shrinkB": 0}
_HALO = withStroke(linewidth=2, foreground="white")
# Moments between two events, crowded where images run together; nearer than this part of the time in between, none.
_MOMENTS, _NEAREST = 100, 1e-10
# Brighter than this, and than so many times the usual of the brightest image, is cut off: an event has no bound. The
# usual is that of a stretch of time, or of a piece of a track.
_BRIGHTEST, _ABOVE_USUAL, _ABOVE_PIECE = 30.0, 10.0, 30.0


def tracks_on_sky(
    ax: Axes, tracks: StarTracks | Sequence[StarTracks], caustics: Sequence[Caustic], edge: Float[Array, "n axes"]
) -> Axes:
    """Tracks on the camera sky, as the camera sees it looking at the hole: one colour an index, in degrees.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    tracks : StarTracks, or several of the same camera
        Triangles mark their events: upward a creation, downward an annihilation.
    caustics : CausticSet, or ()
        Of the same camera; the critical curves are dashed.
    edge : (n, 3) array
        Directions N of the shadow edge, as `shadow_edge` returns them; of an Observer (alpha, beta).

    Notes
    -----
    The projection is that of `camera_sky`: angles from the centre of the shadow are true. Of sources beyond the camera
    half of the sky, 90 degrees around the centre, is shown, and more if a track with events needs it; of sources nearer
    to the hole all tracks, and no more; of the sky of an Observer, which has no end, critical curves and tracks with
    events. Arrows point the way images move while the camera orbits.
    """
    stars = (tracks,) if isinstance(tracks, StarTracks) else tracks
    axes = axes_about(stars[0].camera, edge, [caustic.sky for caustic in caustics])
    outline = azimuthal_equidistant(edge, axes)
    ax.fill(*outline.T, **style.SHADOW)
    curves = [critical_line(caustic, axes) for caustic in caustics]
    for line in curves:
        ax.plot(*line.T, zorder=1.5, **_CRITICAL)
    unit = stars[0].camera.sky_unit
    beyond = any(star.surface.is_beyond(star.camera) for star in stars)
    least, most = (90.0 if beyond else 0.0, 180.0) if unit == "rad" else (0.0, math.inf)
    extents = [np.abs(line).max() for line in (outline, *curves)]
    arrows = []
    for star in stars:
        for track in star.tracks:
            picture = azimuthal_equidistant(track.sky, axes)
            for index, line in moving_lines(star, track, picture, most / 2):
                ax.plot(*line.T, **_track_line(track, index))
                arrows += [(index, line)] * bool(star.angular_velocity)
            if track.events or not beyond:
                extents.append(np.abs(picture).max())
        for event in _all_events(star):
            _mark(ax, azimuthal_equidistant(event.sky, axes), event)
    limit = min(max(least, 1.1 * max(extents)), most)
    ax.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
    for index, line in arrows:
        draw_motion(ax, line, style.order_colour(index + 1))
    return camera_sky_axes(ax, style.tick_step(2 * limit, 7), unit)


def moving_lines(
    star: StarTracks, track: Track, picture: Float[Array, "n 2"], longest: float = 90.0
) -> Iterator[tuple[int, Float[Array, "_ 2"]]]:
    """Index, and line in the order of time, of each piece of a track that is drawn at places (n, 2).

    longest: of a step on the picture, in its unit (degrees); round the back of the sky a short one is longer there.
    """
    for index, which in stretches(track, np.hypot(*_steps(picture, track.closed).T) > longest):
        later = -star.angular_velocity * _later(track.azimuth[which])
        yield index, picture[which if later >= 0 else which[::-1]]


def _later(azimuth: Float[Array, " n"]) -> float:
    """A number with the sign of the way in which the azimuth changes along a piece of a track."""
    # A step over the start of a closed track is a whole turn back.
    return float(np.median(np.sign(np.diff(azimuth)))) if len(azimuth) > 1 else 0.0


def draw_motion(ax: Axes, line: Float[Array, "n 2"], colour: str, spacing: float = 0.6, size: float = 10.0) -> None:
    """Arrow heads along a line (n, 2), in its order: one in its middle, or one every `spacing` of the axes' width.

    Only what lies within the limits of the axes counts; a line shorter than a twentieth of the width has none. size: of
    the heads, points of type.
    """
    (left, right), (low, high) = sorted(ax.get_xlim()), sorted(ax.get_ylim())
    inside: Array = np.all((line > (left, low)) & (line < (right, high)), axis=1)
    # Places that a pinhole has behind it are NaN.
    steps = np.where(inside[1:] & inside[:-1], np.hypot(*np.diff(line, axis=0).T), 0.0)
    way, width = np.concatenate([[0.0], np.cumsum(steps)]), right - left
    if way[-1] < 0.05 * width:
        return
    count = max(1, round(way[-1] / (spacing * width)))
    for middle in (np.arange(count) + 0.5) / count * way[-1]:
        near = middle + width * np.array([-0.006, 0.006])
        tail, head = zip(*(np.interp(near, way, part).tolist() for part in line.T), strict=True)
        if np.hypot(*np.subtract(head, tail)) < 0.05 * width:
            arrow = {**_ARROW, "color": colour, "mutation_scale": size}
            ax.annotate("", head, tail, arrowprops=arrow, zorder=2.6)


def number_images(
    ax: Axes, places: Float[Array, "n 2"], names: Sequence[str], offsets: Real[Array, "n 2"], colour: str = "black"
) -> None:
    """Names such as #1 beside images at places (n, 2), at offsets (n, 2) in points of type."""
    for place, name, offset in zip(places, names, offsets, strict=True):
        text: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "center", "fontweight": "bold"}
        ax.annotate(name, place, tuple(offset), color=colour, path_effects=[_HALO], zorder=5, **text)


def tracks_unrolled(ax: Axes, tracks: StarTracks, caustics: CausticSet, edge: Float[Array, "n axes"]) -> Axes:
    """Distance of the tracks to the shadow edge, logarithmic, against position angle, in degrees: all orders are seen.

    Parameters as for `tracks_on_sky`, with 2000 points of the edge; coordinates as in `camera_sky_unrolled`.
    """
    axes = view_axes(caustics, edge)
    distances = []
    for caustic in caustics:
        line = unrolled_curve(caustic.sky, axes, edge, caustic.closed)
        ax.plot(*line.T, zorder=1.5, **_CRITICAL)
        distances.append(line[:, 1])
    for track in tracks.tracks:
        angle, distance = unrolled_places(track.sky, axes, edge).T
        distances.append(distance)
        for index, which in stretches(track):
            part = unrolled(angle[which], distance[which], closed=False)
            for turn in TURNS:
                ax.plot(part[:, 0] + turn, part[:, 1], **_track_line(track, index))
    for event in _all_events(tracks):
        for turn in TURNS:
            _mark(ax, unrolled_places(event.sky[None], axes, edge)[0] + np.array([turn, 0]), event)
    low, high = np.nanmin(np.concatenate(distances)), np.nanmax(np.concatenate(distances))
    _log_axis(ax, low / 2, high * 2, ticks=9)
    return unrolled_axes(ax, tracks.camera.sky_unit)


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
    _log_axis(ax, faintest / 2, brightest, ticks=7)
    ax.set(xlim=(start, end), xlabel="coordinate time (M)", ylabel="magnification")
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
                ax.plot(phi - 360 * np.floor(phi.min() / 360) + turn, magnification, **_index_line(index))
    _event_verticals(ax, [(math.degrees(event.star[1]), event) for event in _all_events(tracks)])
    power = (tracks.camera.sky_unit != "rad") - (tracks.surface.coordinates[0].unit != "rad")
    unit = {-1: " (1/M²)", 0: "", 1: " (M²)"}[power]
    ax.set(yscale="log", xlim=(0, 360), xlabel="azimuth of the source (deg)", ylabel=f"magnification{unit}")
    ax.set_ylim(top=_ABOVE_PIECE * max(usual))
    ax.xaxis.set_major_locator(MultipleLocator(90))
    return ax


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
            ax.plot(times, strand, **{**_index_line(index), **behind})
            yield strand


def _log_axis(ax: Axes, low: float, high: float, ticks: int) -> None:
    """A logarithmic vertical axis with few ticks."""
    ax.set(yscale="log", ylim=(low, high))
    ax.yaxis.set_major_locator(LogLocator(numticks=ticks))
    ax.yaxis.set_minor_locator(NullLocator())


def tracks_figure(tracks: StarTracks, caustics: CausticSet | None = None) -> Figure:
    """Figure of the tracks of a source: the camera sky and the brightness of the images, 7 inches wide.

    Parameters
    ----------
    tracks : StarTracks
    caustics : CausticSet, optional
        Of the same camera, orders to max_index + 1. Required if the camera orbits; not drawn for sources in the plane.

    Returns
    -------
    Figure
        Save it with `figure.savefig`. If the camera orbits: the camera sky, the same unrolled, the brightness over the
        orbit and, if there is one, through the first creation. Else the camera sky and the brightness by azimuth.
    """
    edge = shadow_edge(tracks.camera, _EDGE_POINTS)
    with rc_context(style.RC):
        handles = tracks_legend(tracks.max_index)
        if tracks.angular_velocity and caustics is not None:
            figure = _figure_in_time(tracks, caustics, edge)
        else:
            figure = _figure_by_azimuth(tracks, caustics or (), edge)
            names = {event.kind for event in _all_events(tracks)} | ({"critical curve"} if caustics else set())
            names |= {f"index {index}" for track in tracks.tracks for index, _ in stretches(track)}
            handles = [handle for handle in handles if handle.get_label() in names]
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
        camera = camera_in_words(tracks.camera) if caustics is None else headline(caustics)
        surface = f" on {tracks.surface.in_words()}\n" if tracks.surface.finite else "; "
        figure.suptitle(f"star at {level_in_words(tracks.surface, tracks.level)}{surface}{camera}")
    return figure


def _figure_by_azimuth(tracks: StarTracks, caustics: Sequence[Caustic], edge: Float[Array, "n axes"]) -> Figure:
    figure = Figure(figsize=(style.PAGE_WIDTH, 3.7), layout="constrained")
    left, right = figure.subplots(1, 2)
    tracks_on_sky(left, tracks, caustics, edge).set_title("tracks, camera sky")
    brightness_by_azimuth(right, tracks).set_title("brightness, once round", pad=9)
    return figure


def _figure_in_time(tracks: StarTracks, caustics: CausticSet, edge: Float[Array, "n axes"]) -> Figure:
    creations = [event for event in tracks.events if event.kind == "creation"]
    figure = Figure(figsize=(style.PAGE_WIDTH, 6.3), layout="constrained")
    grid = figure.add_gridspec(2, 1, height_ratios=[3.1, 2.0])
    top = grid[0].subgridspec(1, 2)
    tracks_on_sky(figure.add_subplot(top[0]), tracks, caustics, edge).set_title("tracks, camera sky")
    tracks_unrolled(figure.add_subplot(top[1]), tracks, caustics, edge).set_title("tracks, unrolled")
    below = grid[1].subgridspec(1, 2 if creations else 1, width_ratios=[1.6, 1.0] if creations else [1.0])
    orbit = brightness(figure.add_subplot(below[0]), tracks, 0.0, tracks.period)
    orbit.set_title("brightness over one orbit", pad=9)
    if creations:
        first = min(creations, key=lambda event: event.order)
        zoom = brightness(figure.add_subplot(below[1]), tracks, *_window(tracks, first))
        zoom.set_title(f"creation of images of index {first.indices[0]} and {first.indices[1]}", pad=9)
    return figure


def tracks_legend(max_index: int) -> list[Line2D]:
    """Handles for a legend of tracks: one line an index, the critical curves, the marks of events."""
    lines = [Line2D([], [], label=f"index {index}", **_index_line(index)) for index in range(max_index + 1)]
    marks = [Line2D([], [], label=kind, **style.event_mark(kind)) for kind in style.EVENTS]
    return [*lines, Line2D([], [], label="critical curve", **_CRITICAL), *marks]


def _window(tracks: StarTracks, event: PairEvent) -> tuple[float, float]:
    """A twentieth of an orbit about an event, less where another one of the same order is near."""
    times = np.array([e.moment for e in tracks.events if e.order == event.order and e is not event])
    away = np.abs((times - event.moment + tracks.period / 2) % tracks.period - tracks.period / 2)
    half = min(0.025 * tracks.period, 0.5 * away.min(initial=tracks.period))
    return event.moment - half, event.moment + half


def _all_events(tracks: StarTracks) -> tuple[PairEvent, ...]:
    return (*tracks.events, *tracks.ends)


def _events_between(tracks: StarTracks, start: float, end: float) -> list[tuple[float, PairEvent]]:
    """Events with start < time < end, in the order of time, period after period."""
    moments = []
    for event in _all_events(tracks):
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
            chosen = linear_sum_assignment(gap)[1]
            which, sky = which[chosen], sky[chosen]
        strands[i], before = image.magnification[which], sky
    yield from strands.T


def _steps(picture: Float[Array, "n 2"], closed: bool) -> Float[Array, "n 2"]:
    """Steps (n, 2) between neighbours on a track, the last one back to the first point, or none where it is open."""
    steps = np.roll(picture, -1, axis=0) - picture
    if not closed:
        steps[-1] = 0
    return steps


def stretches(track: Track, broken: Bool[Array, " n"] | None = None) -> Iterator[tuple[int, Int[Array, " _"]]]:
    """Points of the pieces of a track that have one index, each with the events at its ends; and that index.

    broken (n,): True where the step after a point is not to be drawn.
    """
    order = np.arange(len(track))
    if track.closed:
        # From an event, or from anywhere where there is none, once round.
        begin = track.places[0] if track.places else 0
        order = np.append(np.roll(order, -begin), begin)
    cuts = np.flatnonzero(track.parity[order] == 0).tolist()
    if broken is not None:
        cuts += (np.flatnonzero(broken[order[:-1]]) + 1).tolist()
    bounds = sorted({0, *cuts, len(order) - 1})
    for first, last in pairwise(bounds):
        which = order[first : last + 1]
        if broken is not None and broken[which[-2]]:
            which = which[:-1]
        plain = track.index[which][track.parity[which] != 0]
        if len(plain):
            yield int(plain[0]), which


def _index_line(index: int) -> dict[str, Any]:
    return {**style.order_line(index + 1), "linewidth": 1.0}


def _track_line(track: Track, index: int) -> dict[str, Any]:
    """Line settings of a track; one that is a point is a dot."""
    return {**_index_line(index), **({"marker": "o", "markersize": 3.0} if len(track) == 1 else {})}


def _mark(ax: Axes, place: Float[Array, "2"], event: PairEvent) -> None:
    ax.plot([place[0]], [place[1]], **style.event_mark(event.kind))
