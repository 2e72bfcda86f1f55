"""
Pair creation and annihilation
==============================

The images of one star just before and just after two of them are created, and just before two are annihilated: on the
camera sky (left), next to the shadow edge (right, above: the distance to the edge is drawn out by its logarithm), and
on the celestial sphere (right, below), where the star crosses the secondary caustic. a = 0.999, circular orbit at
r = 6.03. The images #1, #2 and #3 lie on the track of order ε = 1, whose rays cross the equatorial plane once. Remakes
JTFT figure 6.

The paper's: hole, camera, the star 18 degrees above the equatorial plane (θ′ = 0.392 π; JTFT counts it from the other
pole, as 0.608 π), the moments after the creation and before the annihilation, the numbers, the track just below the
shadow. Ours: the first row, a time of 1 M from the events, the drawn-out view, larger dots for brighter images, and one
colour for each index on the tracks. #1 is there all the time. At the creation #2 and #3 spring up together, #2 inside
the secondary critical curve (index 2) and #3 outside (index 1). #2 then moves along the track counter-clockwise, #1 and
#3 clockwise. On the other side #2 meets #1, both vanish, and #3 has taken the place of #1. The primary image, of order
0, is behind the camera at these times.
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
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.palettes import STAR_COLOUR
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant, unrolled_places, view_axes
from kerrcaustics.draw.titles import headline
from kerrcaustics.draw.tracks import (
    draw_motion,
    moving_lines,
    number_images,
    tracks_legend,
    tracks_on_sky,
    tracks_unrolled,
)
from kerrcaustics.tracks.tracks import StarTracks

CAMERA = kc.Camera(spin=0.999, radius=6.03)
STAR = 0.392 * math.pi
# How long before and after an event, units of M.
SOON = 1.0
VIEW = 70.0
# From the dots to the middle of their numbers, points of type; and from where on dots push numbers away, degrees.
BESIDE, CLOSE = 12.0, 15.0
# Size of the dot of an image as bright as its star (points), magnitudes by which dots grow one point, and the limits.
SIZE, MAGNITUDES, SIZES = 6.5, 1.0, (2.5, 9.0)


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=2), kc.shadow_edge(CAMERA, 2000)
    tracks = kc.star_tracks(CAMERA, STAR, max_index=2)
    # Marks of the events alone: the track is drawn in one colour.
    bare = replace(tracks, tracks=(), ends=())
    created, annihilated = tracks.events
    moments = {
        f"{SOON:g} M before the creation": created.moment - SOON,
        f"{SOON:g} M after the creation": created.moment + SOON,
        f"{SOON:g} M before the annihilation": annihilated.moment - SOON,
    }
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 9.9), layout="constrained")
        for row, (title, time) in zip(figure.subfigures(3, 1), moments.items(), strict=True):
            panels = row.subplot_mosaic([["sky", "near"], ["sky", "sphere"]], width_ratios=(1, 1.1))
            images = tracks.images_at(time)
            tracks_on_sky(panels["sky"], bare, caustics, edge)
            panels["sky"].set(xlim=(-VIEW, VIEW), ylim=(-VIEW, VIEW))
            draw_tracks(panels["sky"], tracks, view_axes(CAMERA, edge))
            draw_images(panels["sky"], images, view_axes(CAMERA, edge)).set_title(title)
            draw_near(panels["near"], replace(tracks, tracks=tracks.tracks[1:2], ends=()), images, caustics, edge)
            draw_star(panels["sphere"], tracks, time, caustics).set_title(f"celestial sphere at t = {time:.1f} M")
        figure.legend(handles=tracks_legend([tracks], True), loc="outside lower center", ncols=6)
        figure.suptitle(f"star at θ′ = {math.degrees(STAR):.2f} deg; {headline(caustics)}")
    return write_line_art(figure, output, "pair_creation")


def draw_tracks(ax: Axes, tracks: StarTracks, axes: np.ndarray) -> None:
    """The tracks of order 0 and 1, with arrows; those of higher order hug the shadow."""
    for track in tracks.tracks[:2]:
        for index, line in moving_lines(tracks, track, azimuthal_equidistant(track.sky, axes)):
            ax.plot(*line.T, **style.index_line(index), linewidth=1.0, scalex=False, scaley=False)
            draw_motion(ax, line, style.index_colour(index), spacing=0.35)


def draw_images(ax: Axes, images: kc.StarImages, axes: np.ndarray) -> Axes:
    """The images at one moment as dots, the brighter the larger, with their numbers, which follow from index and side.

    That of #2 stands by its dot within the shadow, the others by theirs outside.
    """
    first = images.crossings <= 1
    places = azimuthal_equidistant(images.sky[first], axes)
    names = names_of(images.index[first], places)
    seen = np.abs(places).max(axis=1) < VIEW
    # Below the marks of events, which they may come close to.
    for place, size in zip(places[seen], sizes_of_dots(images.magnification[first][seen]), strict=True):
        ax.plot(*place, "o", markersize=size, color="black", zorder=2.4)
    shown = [name for name, here in zip(names, seen, strict=True) if here]
    number_images(ax, places[seen], shown, BESIDE * sides_of_numbers(places[seen], shown))
    return ax


def draw_near(ax: Axes, tracks: StarTracks, images: kc.StarImages, caustics: CausticSet, edge: np.ndarray) -> None:
    """The images of order 1 at their distances from the shadow edge, with their numbers."""
    axes = view_axes(CAMERA, edge)
    tracks_unrolled(ax, tracks, caustics, edge)
    ax.set(title="distance to the shadow edge", ylabel="distance (deg)", ylim=(0.2, 80))
    first = images.crossings == 1
    places = unrolled_places(images.sky[first], axes, edge)
    for place, size in zip(places, sizes_of_dots(images.magnification[first]), strict=True):
        ax.plot(*place, "o", markersize=size, color="black", zorder=2.4)
    names = names_of(images.index[first], azimuthal_equidistant(images.sky[first], axes))
    number_images(ax, places, names, np.array([(0, -BESIDE if name == "#2" else BESIDE) for name in names]))


def names_of(index: np.ndarray, places: np.ndarray) -> list[str]:
    """Numbers of images of order 0 and 1 of these Morse indices, at these places (n, 2) on the camera sky.

    Of those of index 1, #1 is on the left from one event to the other.
    """
    return ["#0" if k == 0 else "#2" if k == 2 else "#1" if place[0] < 0 else "#3"
            for k, place in zip(index, places, strict=True)]  # fmt: skip


def sizes_of_dots(magnification: np.ndarray) -> np.ndarray:
    """Sizes (n,) of dots, points: as for stars on charts, one more for so many magnitudes."""
    return np.clip(SIZE + np.log10(magnification) / 0.4 / MAGNITUDES, *SIZES)


def sides_of_numbers(places: np.ndarray, names: list[str]) -> np.ndarray:
    """Unit vectors (n, 2) from dots at places (n, 2) to their numbers: away from the shadow, and from other dots."""
    outward = places / np.linalg.norm(places, axis=1, keepdims=True)
    gaps = places[:, None] - places
    distance = np.linalg.norm(gaps, axis=2)[..., None] + np.eye(len(places))[..., None]
    pushed = (gaps / distance * np.minimum(CLOSE / distance, 1)).sum(axis=1)
    side = pushed + outward * np.where([name == "#2" for name in names], -1, 1)[:, None]
    return side / np.linalg.norm(side, axis=1, keepdims=True)


def draw_star(ax: Axes, tracks: StarTracks, time: float, caustics: CausticSet) -> Axes:
    """The caustics and the star on its way, phi' relative to the camera."""
    theta, phi = np.degrees(tracks.level), np.degrees(tracks.azimuth_at(time)) % 360
    ax.plot([0, 360], [theta, theta], color=style.GUIDE_COLOUR, zorder=0.5)
    ax.annotate("", (phi - 45, theta), (phi, theta), arrowprops={"arrowstyle": "->", "linewidth": 0.8})
    for caustic in caustics:
        line = np.degrees(np.concatenate([caustic.celestial, caustic.celestial[:1]]))
        ax.plot(line[:, 1], line[:, 0], **style.order_line(caustic.order))
        text = {"textcoords": "offset points", "va": "top", "color": style.order_colour(caustic.order)}
        if caustic.order == 1:
            # A dot, whose name stands below the other.
            text["arrowprops"] = {"arrowstyle": "-", "linewidth": 0.7, "color": text["color"], "shrinkB": 2}
        name, below = style.order_name(caustic.order), -20 if caustic.order == 1 else -16
        ax.annotate(name, (line[:, 1].min(), 90), (0, below), **text)
    ax.plot(phi, theta, "*", markersize=9, color=STAR_COLOUR)
    label = "φ′ relative to the camera (deg), seen from outside"
    ax.set(xlim=(0, 360), ylim=(150, 30), xlabel=label, ylabel="θ′ (deg)")
    ax.xaxis.set_major_locator(MultipleLocator(90))
    ax.yaxis.set_major_locator(MultipleLocator(30))
    return ax


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
