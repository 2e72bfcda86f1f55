"""Light curves as figures: the flux, image by image, and where on the sky it comes from.

Images of a point or a ball have the colour of their Morse index, those of a spot that of their crossing of the plane.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.draw import style
from kerrcaustics.draw.projection import about_shadow, whole_line
from kerrcaustics.draw.sky_axes import name_sky_axes
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.interop.physical_scale import PhysicalScale
from kerrcaustics.light_curves.results import LightCurve, LightEvent
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.isoradials import isoradials

Array = np.ndarray

_TURN = 2 * math.pi
# Light fainter than this part of the brightest is not shown.
_FAINTEST = 3e-5
# Points of the image of a spot's orbit.
ORBIT_POINTS = 1440
# Times that are added about an event.
_MOMENTS = 61
# The farthest of them, in times in which the spot moves by its size.
_NEAR = 6.0
_NUMERALS = ("first", "second", "third", "fourth", "fifth", "sixth")


def light_curve_figure(light: LightCurve, scale: PhysicalScale | None = None) -> Figure:
    """Flux against time; below, the images about the shadow, where pairs are born and die, and the centroid's path.

    scale: mass of the hole, for times in minutes; with a distance, for an observer's sky in microarcseconds.
    """
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.9), layout="constrained")
        upper, lower = figure.subplots(2, 1, height_ratios=[1, 1.2])
        own: Any = show_flux(upper, light, scale).get_legend()
        own.remove()
        show_images(lower, light, scale)
        entries = _entries(upper, lower)
        figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=4)
        figure.suptitle(f"{in_words(light)}; {viewer_in_words(light.camera)}")
    return figure


def in_words(light: LightCurve) -> str:
    """The source and its orbit, for titles."""
    kind = light.orbit.partition("(")[0]
    return f"{light.source} on " + (f"a circle of r = {light.radius:g}" if kind == "circle" else f"an orbit ({kind})")


def crowded_times(light: LightCurve) -> Float[Array, " times"]:
    """The times of a spot's light curve, and more next to its events, where the flux changes fast."""
    width = light.size / light.radius * light.period / _TURN
    beside = width * np.linspace(-_NEAR, _NEAR, _MOMENTS)
    added = np.concatenate([light.time, *(event.moment + beside for event in light.events)])
    return np.unique(added[(added >= light.time.min()) & (added <= light.time.max())])


class _Line(NamedTuple):
    """How an image is drawn, and what it adds: its share at times when it exists, else NaN."""

    colour: Any
    label: str
    share: Array


def _lines(light: LightCurve) -> Iterator[_Line]:
    """The images of a light curve."""
    for index, crossing, share, emitted in zip(
        light.index.tolist(), light.crossing.tolist(), light.shares, light.emission_time, strict=True
    ):
        visible_share = np.where(np.isfinite(emitted), share, np.nan)
        if crossing:
            yield _Line(style.crossing_colour(crossing), f"{_name(crossing)} crossing", np.maximum(share, 1e-300))
        else:
            yield _Line(style.index_colour(index), f"index {index}", visible_share)


def _event_mark(light: LightCurve, event: LightEvent) -> dict[str, Any]:
    """The mark of an event, in the colour of its images, and its name."""
    colour = style.crossing_colour if light.source == "spot" else style.index_colour
    return {**style.event_mark(event.kind), "markeredgecolor": colour(event.order), "label": event.kind}


def show_flux(ax: Axes, light: LightCurve, scale: PhysicalScale | None = None) -> Axes:
    """The flux, what each image adds to it, and when images are created (up) and annihilated (down).

    scale: of the time, which is in M without one.
    """
    unit, each = ("M", 1.0) if scale is None else scale.time_unit
    order = np.argsort(light.time)
    time, named = each * light.time[order], set()
    ax.semilogy(time, light.flux[order], color="black", label="all")
    for line in _lines(light):
        label = None if line.label in named else line.label
        ax.semilogy(time, line.share[order], color=line.colour, lw=1, label=label)
        named.add(line.label)
    for event in light.events:
        ax.axvline(each * event.moment, color=style.GUIDE_COLOUR, lw=0.6, zorder=0.5)
        ax.plot(
            [each * event.moment], [1.0], transform=ax.get_xaxis_transform(), clip_on=False, **_event_mark(light, event)
        )
    most = np.nanmax(light.flux, initial=0.0)
    if most > 0:
        ax.set_ylim(_FAINTEST * most, 2 * most)
    if time[-1] > time[0]:
        ax.set_xlim(time[0], time[-1])
    of_spot = f"flux of a unit spot ({sky_area(light.camera)})"
    ax.set(xlabel=f"time of the viewer ({unit})", ylabel=of_spot if light.source == "spot" else "flux for luminosity 1")
    entries = _entries(ax)
    ax.legend(entries.values(), entries.keys(), ncols=2, fontsize="small")
    return ax


def _entries(*panels: Axes) -> dict[str, Any]:
    """What a legend lists, each label once."""
    listed = [ax.get_legend_handles_labels() for ax in panels]
    return {label: handle for handles, labels in listed for handle, label in zip(handles, labels, strict=True)}


def show_images(ax: Axes, light: LightCurve, scale: PhysicalScale | None = None) -> None:
    """The images about the shadow; creations (up), annihilations (down), and the path of the centroid (grey).

    Of a spot they are the whole images of its orbit, of others their paths within the times.
    """
    ax.fill(*about_shadow(light.camera, shadow_edge(light.camera, 400)).T, label="shadow", **style.SHADOW)
    order = np.argsort(light.time)
    if light.source == "spot":
        for curve in isoradials(light.camera, [light.radius], len(light.shares), ORBIT_POINTS):
            line = about_shadow(light.camera, whole_line(curve.sky, True))
            ax.plot(*line.T, color=style.crossing_colour(curve.crossing), lw=1)
    else:
        for line, sky in zip(_lines(light), light.sky[:, order], strict=True):
            ax.plot(*about_shadow(light.camera, sky).T, color=line.colour, lw=1)
    path = about_shadow(light.camera, light.centroid[order])
    ax.plot(*path.T, color="0.4", lw=0.8, ls=(0, (4, 2)), label="centroid of all light")
    for event in light.events:
        ax.plot(*about_shadow(light.camera, event.sky[None]).T, **_event_mark(light, event))
    name_sky_axes(ax, light.camera.sky_unit, scale)


def sky_area(viewer: Viewer) -> str:
    """The unit of solid angles on the sky of a viewer."""
    return "sr" if viewer.sky_unit == "rad" else "M²"


def _name(crossing: int) -> str:
    return _NUMERALS[crossing - 1] if crossing <= len(_NUMERALS) else f"{crossing}th"
