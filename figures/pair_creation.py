"""
Pair creation and annihilation
==============================

The images of one star, at θ′ = 77 degrees, shortly before and after two of them are created, and shortly before they
are annihilated: on the camera sky (left) beside the celestial sphere (right), where the star crosses the secondary
caustic. a = 0.999, circular orbit at r = 6.03. Remakes JTFT figure 6.

As there, the star drifts along its line of latitude while the camera moves on; it enters the secondary caustic
through one fold and leaves it through another. At the first a pair of images, of index 1 and 2, springs up on the
secondary critical curve on the right, the retrograde, side; one of the two then moves away outward, one inward. At
the second the pair that vanishes on the prograde side is another one: the inner image of the new pair meets the image
of index 1 that was there all the time. Images of order ε = 0 and 1, by crossings of the equatorial plane, are shown;
the first one, of index 0, is behind the camera at these times, and those of higher order hug the shadow.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.files import write_line_art
from kerrcaustics.draw.plots import headline
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes
from kerrcaustics.draw.tracks import tracks_legend, tracks_on_sky

CAMERA = kc.Camera(spin=0.999, radius=6.03)
STAR = math.radians(77)
# How long before and after an event, units of M.
SOON = 1.0
VIEW = 70.0


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=2), kc.shadow_edge(CAMERA, 2000)
    tracks = kc.star_tracks(CAMERA, STAR, max_index=2)
    # Those of order 0 and 1; the third is of order 2.
    shown = replace(tracks, tracks=tracks.tracks[:2], ends=())
    created, annihilated = tracks.events
    moments = {
        f"{SOON:g} M before the creation": created.time - SOON,
        f"{SOON:g} M after the creation": created.time + SOON,
        f"{SOON:g} M before the annihilation": annihilated.time - SOON,
    }
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 8.6), layout="constrained")
        rows = figure.subplots(3, 2, width_ratios=(1, 1.25))
        for (sky, sphere), (title, time) in zip(rows, moments.items(), strict=True):
            tracks_on_sky(sky, shown, caustics, edge)
            draw_images(sky, tracks.images_at(time), view_axes(caustics, edge)).set_title(title)
            draw_star(sphere, tracks, time, caustics).set_title(f"celestial sphere at t = {time:.1f} M")
        figure.legend(handles=tracks_legend(2), loc="outside lower center", ncols=6)
        figure.suptitle(f"star at θ′ = {math.degrees(STAR):.12g} deg; {headline(caustics)}")
    return write_line_art(figure, output, "pair_creation")


def draw_images(ax: Axes, images: kc.StarImages, axes: np.ndarray) -> Axes:
    """The images at one moment as dots, in the colour of their index."""
    first = images.crossings <= 1
    for place, index in zip(azimuthal_equidistant(images.sky[first], axes), images.index[first], strict=True):
        ax.plot(*place, "o", markersize=6, color=style.order_colour(index + 1), markeredgecolor="black", zorder=4)
    ax.set(xlim=(-VIEW, VIEW), ylim=(-VIEW, VIEW), aspect="equal")
    return ax


def draw_star(ax: Axes, tracks: kc.StarTracks, time: float, caustics: kc.CausticSet) -> Axes:
    """The caustics and the star on its way, phi' relative to the camera."""
    theta, phi = np.degrees(tracks.theta), np.degrees(tracks.azimuth_at(time)) % 360
    ax.plot([0, 360], [theta, theta], color=style.GUIDE_COLOUR, zorder=0.5)
    ax.annotate("", (phi - 45, theta), (phi, theta), arrowprops={"arrowstyle": "->", "linewidth": 0.8})
    for caustic in caustics:
        line = np.degrees(np.concatenate([caustic.celestial, caustic.celestial[:1]]))
        ax.plot(line[:, 1], line[:, 0], **style.order_line(caustic.order))
        text = {"textcoords": "offset points", "va": "top", "color": style.order_colour(caustic.order)}
        ax.annotate(
            style.order_name(caustic.order), (line[:, 1].min(), 90), (0, -16 if caustic.order == 2 else -3), **text
        )
    ax.plot(phi, theta, "*", markersize=9, color="black")
    ax.set(xlim=(0, 360), ylim=(150, 30), xlabel="φ′ − that of the camera (deg)", ylabel="θ′ (deg)")
    ax.xaxis.set_major_locator(MultipleLocator(90))
    ax.yaxis.set_major_locator(MultipleLocator(30))
    return ax


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
