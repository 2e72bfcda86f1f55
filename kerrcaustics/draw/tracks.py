"""Pictures of tracks on the camera sky, and unrolled at the shadow edge."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import (
    TURNS,
    azimuthal_equidistant,
    unrolled,
    unrolled_curve,
    unrolled_places,
    view_axes,
)
from kerrcaustics.draw.sky_axes import camera_sky_axes, critical_line, unrolled_axes
from kerrcaustics.shapes import Bool, Float, Int, Real
from kerrcaustics.tracks.events import PairEvent
from kerrcaustics.tracks.tracks import StarTracks, Track

Array = np.ndarray

_ARROW: dict[str, Any] = {"arrowstyle": "-|>", "linewidth": 0, "shrinkA": 0, "shrinkB": 0}
_HALO = withStroke(linewidth=2, foreground="white")


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
    axes = view_axes(stars[0].camera, edge)
    outline = azimuthal_equidistant(edge, axes)
    ax.fill(*outline.T, **style.SHADOW)
    curves = [critical_line(caustic, axes) for caustic in caustics]
    for line in curves:
        ax.plot(*line.T, zorder=1.5, **style.CRITICAL)
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
        for event in all_events(star):
            _mark(ax, azimuthal_equidistant(event.sky, axes), event)
    limit = min(max(least, 1.1 * max(extents)), most)
    ax.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
    for index, line in arrows:
        draw_motion(ax, line, style.index_colour(index))
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
    axes = view_axes(caustics.camera, edge)
    distances = []
    for caustic in caustics:
        line = unrolled_curve(caustic.sky, axes, edge, caustic.closed)
        ax.plot(*line.T, zorder=1.5, **style.CRITICAL)
        distances.append(line[:, 1])
    for track in tracks.tracks:
        angle, distance = unrolled_places(track.sky, axes, edge).T
        distances.append(distance)
        for index, which in stretches(track):
            part = unrolled(angle[which], distance[which], closed=False)
            for turn in TURNS:
                ax.plot(part[:, 0] + turn, part[:, 1], **_track_line(track, index))
    for event in all_events(tracks):
        for turn in TURNS:
            _mark(ax, unrolled_places(event.sky[None], axes, edge)[0] + np.array([turn, 0]), event)
    low, high = np.nanmin(np.concatenate(distances)), np.nanmax(np.concatenate(distances))
    style.log_axis(ax, low / 2, high * 2, ticks=9)
    return unrolled_axes(ax, tracks.camera.sky_unit)


def tracks_legend(stars: Sequence[StarTracks], curves: bool) -> list[Line2D]:
    """Handles for a legend of tracks: the indices that there are, critical curves, the marks of events."""
    indices = sorted({index for star in stars for track in star.tracks for index, _ in stretches(track)})
    kinds = {event.kind for star in stars for event in all_events(star)}
    lines = [Line2D([], [], label=f"index {index}", **index_line(index)) for index in indices]
    lines += [Line2D([], [], label="critical curve", **style.CRITICAL)] * curves
    return lines + [Line2D([], [], label=kind, **style.event_mark(kind)) for kind in style.EVENTS if kind in kinds]


def all_events(tracks: StarTracks) -> tuple[PairEvent, ...]:
    """Events of tracks, and the ends of open ones."""
    return (*tracks.events, *tracks.ends)


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


def index_line(index: int) -> dict[str, Any]:
    """Line settings of tracks of an index."""
    return {**style.index_line(index), "linewidth": 1.0}


def _track_line(track: Track, index: int) -> dict[str, Any]:
    """Line settings of a track; one that is a point is a dot."""
    return {**index_line(index), **({"marker": "o", "markersize": 3.0} if len(track) == 1 else {})}


def _mark(ax: Axes, place: Float[Array, "2"], event: PairEvent) -> None:
    ax.plot([place[0]], [place[1]], **style.event_mark(event.kind))
