"""Picture of a source that circles in the equatorial plane: tracks on the camera sky, and how bright its images are."""

import math
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from kerrcaustics.draw import style
from kerrcaustics.draw.projection import axes_about, azimuthal_equidistant
from kerrcaustics.draw.sky_axes import camera_sky_axes
from kerrcaustics.draw.tracks import stretches
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.stars.events import PairEvent
from kerrcaustics.stars.tracks import StarTracks

Array = np.ndarray

_EDGE_POINTS = 800
# Brighter than so many times the brightest usual image is cut off: an event has no bound.
_ABOVE_USUAL = 30.0
_TURNS = (-720, -360, 0, 360, 720)


def plane_tracks_figure(tracks: StarTracks) -> Figure:
    """Tracks on the camera sky beside the magnification of each image by the azimuth of the source; 7 inches wide."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.7), layout="constrained")
        left, right = figure.subplots(1, 2)
        plane_tracks_on_sky(left, tracks).set_title("tracks, camera sky")
        plane_brightness(right, tracks).set_title("brightness, once round", pad=9)
        figure.legend(handles=_legend(tracks), loc="outside lower center", ncols=6)
        camera = tracks.camera
        where = (
            f"spin {camera.spin:g}, $r_c$ = {camera.radius:g}, inclination {math.degrees(camera.inclination):.4g} deg"
        )
        figure.suptitle(f"circle r = {tracks.level:g}, {tracks.surface.in_words()}; {where}")
    return figure


def plane_tracks_on_sky(ax: Axes, tracks: StarTracks) -> Axes:
    """Tracks about the shadow, as the camera sees them looking at the hole, one colour an index, in degrees."""
    edge = shadow_edge(tracks.camera, _EDGE_POINTS)
    axes = axes_about(tracks.camera, edge, [])
    shadow = azimuthal_equidistant(edge, axes)
    ax.fill(*shadow.T, **style.SHADOW)
    reach = [np.abs(shadow).max()]
    for track in tracks.tracks:
        picture = azimuthal_equidistant(track.sky, axes)
        reach.append(np.abs(picture).max())
        for index, which in stretches(track):
            ax.plot(*picture[which].T, **_line(index))
    for event in _events(tracks):
        ax.plot(*azimuthal_equidistant(event.sky, axes), **style.event_mark(event.kind))
    limit = min(1.15 * max(reach), 180.0)
    ax.set(xlim=(-limit, limit), ylim=(-limit, limit))
    ax.set_aspect("equal", adjustable="box")
    return camera_sky_axes(ax, style.tick_step(2 * limit, 7))


def plane_brightness(ax: Axes, tracks: StarTracks) -> Axes:
    """Magnification of every image against the azimuth of the source, degrees; verticals are the events."""
    usual = [1e-300]
    for track in tracks.tracks:
        azimuth = np.degrees(track.azimuth)
        for index, which in stretches(track):
            bright = track.magnification[which]
            usual.append(float(np.median(bright)))
            # Over the end of a closed track the azimuth jumps back by its turns.
            phi = azimuth[which] + 360 * track.turns * np.append(0, np.cumsum(np.diff(which) < 0))
            for turn in _TURNS:
                ax.plot(phi - 360 * np.floor(phi.min() / 360) + turn, bright, **_line(index))
    for event in _events(tracks):
        phi = math.degrees(event.azimuth)
        ax.axvline(phi, color=style.GUIDE_COLOUR, linewidth=0.6, zorder=0.5)
        ax.plot(
            [phi],
            [1.0],
            transform=ax.get_xaxis_transform(),
            clip_on=False,
            **style.event_mark(event.kind),
        )
    ax.set_yscale("log")
    ax.set(xlim=(0, 360), xlabel="azimuth of the source (deg)", ylabel="magnification (1/M²)")
    ax.set_ylim(top=_ABOVE_USUAL * max(usual))
    ax.xaxis.set_major_locator(MultipleLocator(90))
    return ax


def _line(index: int) -> dict[str, Any]:
    return {**style.order_line(index + 1), "linewidth": 1.0}


def _events(tracks: StarTracks) -> tuple[PairEvent, ...]:
    return (*tracks.events, *tracks.ends)


def _legend(tracks: StarTracks) -> list[Line2D]:
    seen = sorted({index for track in tracks.tracks for index, _ in stretches(track)})
    lines = [Line2D([], [], label=f"index {index}", **_line(index)) for index in seen]
    kinds = sorted({event.kind for event in _events(tracks)}, reverse=True)
    return [
        *lines,
        *(Line2D([], [], label=kind, **style.event_mark(kind)) for kind in kinds),
    ]
