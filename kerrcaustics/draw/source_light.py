"""Light curves of sources that move, as figures: their flux, image by image, and the ways of the images on the sky."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kerrcaustics.draw import style
from kerrcaustics.draw.projection import about_shadow
from kerrcaustics.draw.sky_axes import name_sky_axes
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.spacetime.shadow import shadow_edge

if TYPE_CHECKING:
    from kerrcaustics.light_curves.source_light import SourceLightCurve


def source_light_figure(light: "SourceLightCurve") -> Figure:
    """Flux against time with the shares of the images; below, the ways of the images about the shadow, and events."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 7.2), layout="constrained")
        upper, lower = figure.subplots(2, 1, height_ratios=[1, 1.3])
        show_flux(upper, light)
        _show_ways(lower, light)
        figure.suptitle(f"source in motion ({light.orbit.partition('(')[0]}); {viewer_in_words(light.camera)}")
    return figure


def show_flux(ax: Axes, light: "SourceLightCurve") -> Axes:
    """The flux and what each image adds, one colour an index; creations (up) and annihilations (down)."""
    order = np.argsort(light.time)
    ax.semilogy(light.time[order], light.flux[order], color="black", label="all images")
    named = set()
    for index, share, emitted in zip(light.index.tolist(), light.shares, light.emission_time, strict=True):
        there = np.where(np.isfinite(emitted), share, np.nan)
        label = None if index in named else f"index {index}"
        ax.semilogy(light.time[order], there[order], color=style.index_colour(index), lw=1, label=label)
        named.add(index)
    for event in light.events:
        ax.axvline(event.moment, color=style.GUIDE_COLOUR, lw=0.6, zorder=0.5)
        mark = {**style.event_mark(event.kind), "markeredgecolor": style.index_colour(event.order)}
        ax.plot([event.moment], [1.0], transform=ax.get_xaxis_transform(), clip_on=False, **mark)
    ax.set(xlabel="time of the viewer (M)", ylabel="flux for luminosity 1")
    ax.legend(fontsize="small")
    return ax


def _show_ways(ax: Axes, light: "SourceLightCurve") -> None:
    """The ways of the images about the shadow, places of events, and the way of the centroid (grey)."""
    ax.fill(*about_shadow(light.camera, shadow_edge(light.camera, 400)).T, label="shadow", **style.SHADOW)
    order = np.argsort(light.time)
    for index, sky in zip(light.index.tolist(), light.sky[:, order], strict=True):
        ax.plot(*about_shadow(light.camera, sky).T, color=style.index_colour(index), lw=1)
    way = about_shadow(light.camera, light.centroid[order])
    ax.plot(*way.T, color="0.4", lw=0.8, ls=(0, (4, 2)), label="centroid of all light")
    named = set()
    for event in light.events:
        mark = {**style.event_mark(event.kind), "markeredgecolor": style.index_colour(event.order)}
        label = None if event.kind in named else event.kind
        ax.plot(*about_shadow(light.camera, event.sky[None]).T, label=label, **mark)
        named.add(event.kind)
    name_sky_axes(ax, light.camera.sky_unit)
    ax.legend(fontsize="small")
