"""The figure of the tracks of a source: where its images are, and how bright."""

from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.brightness import brightness, brightness_by_azimuth
from kerrcaustics.draw.titles import headline, level_in_words, viewer_in_words
from kerrcaustics.draw.tracks import tracks_legend, tracks_on_sky, tracks_unrolled
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.tracks.events import PairEvent
from kerrcaustics.tracks.tracks import StarTracks

Array = np.ndarray

_EDGE_POINTS = 2000


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
        handles = tracks_legend([tracks], bool(caustics))
        if tracks.angular_velocity and caustics is not None:
            figure = _figure_in_time(tracks, caustics, edge)
        else:
            figure = _figure_by_azimuth(tracks, caustics or (), edge)
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
        camera = viewer_in_words(tracks.camera) if caustics is None else headline(caustics)
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


def _window(tracks: StarTracks, event: PairEvent) -> tuple[float, float]:
    """A twentieth of an orbit about an event, less where another one of the same order is near."""
    times = np.array([e.moment for e in tracks.events if e.order == event.order and e is not event])
    away = np.abs((times - event.moment + tracks.period / 2) % tracks.period - tracks.period / 2)
    half = min(0.025 * tracks.period, 0.5 * away.min(initial=tracks.period))
    return event.moment - half, event.moment + half
