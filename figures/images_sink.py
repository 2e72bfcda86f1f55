"""
Images sink toward the shadow
=============================

The images of one star at the flat left edge of the shadow, for a = 0.999 and a circular orbit at r = 2.6. The star
is at rest, 5 degrees above the equatorial plane. With each orbit of the camera, and each further trip of the light
round the hole in the prograde sense, an image sinks toward the shadow. (a) The camera sky at that edge, with the
distance to it drawn out on a logarithmic scale; dots are the images at one moment, numbered by trips, and arrows point
the way they move. (b) Distance to the shadow edge, and (c) angle from the camera's equatorial plane, along both tracks.
JTFT states this without a figure.

The paper's: hole, camera, that the latitude of an image grows toward a critical curve and decreases beyond it. Ours:
the star. Its image of index 1 sinks from 38 to 6.9 degrees, where it meets a partner at the secondary critical curve
and vanishes; the one of index 2 takes over at 5.3 degrees, on the other side of the plane, and ends at the tertiary
curve.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import unrolled_curve, unrolled_places, view_axes
from kerrcaustics.draw.sky_axes import unrolled_axes
from kerrcaustics.draw.titles import headline
from kerrcaustics.draw.tracks import number_images, stretches
from kerrcaustics.tracks.tracks import StarTracks

CAMERA = kc.Camera(spin=0.999, radius=2.6)
STAR = math.radians(85)
# Azimuth of the star at the moment of the dots.
MOMENT = math.pi
DOT = {"linestyle": "none", "marker": "o", "markersize": 4, "markeredgecolor": "black", "markeredgewidth": 0.6}


def sinking(tracks: StarTracks, index: int, edge: np.ndarray) -> np.ndarray:
    """Columns: trips, position angle and distance to the edge (deg), latitude (deg), along the image of an index.

    In the order of time, from where the image is farthest from the shadow. Its order ε is the index.
    """
    track = tracks.tracks[index]
    which = next(which for k, which in stretches(track) if k == index)
    sky, azimuth = track.sky[which], np.unwrap(track.azimuth[which])
    places = unrolled_places(sky, view_axes(CAMERA, edge), edge)
    rows = np.column_stack([-azimuth / (2 * math.pi), places, np.degrees(np.arcsin(sky[:, 2]))])
    rows = rows[np.argsort(rows[:, 0])]
    beside = rows[np.abs(rows[:, 1] - 180) < 90]
    return beside[beside[:, 2].argmax() :]


def at_moment(rows: np.ndarray) -> np.ndarray:
    """The rows of the images at the moment of the dots, one for each trip."""
    trips = np.arange(math.ceil(rows[0, 0] + MOMENT / (2 * math.pi)), rows[-1, 0] + MOMENT / (2 * math.pi))
    return np.column_stack([np.interp(trips - MOMENT / (2 * math.pi), rows[:, 0], column) for column in rows.T])


def left_edge(ax: Axes, images: dict[int, np.ndarray], caustics: CausticSet, edge: np.ndarray) -> Axes:
    """The sky at the left edge, with the images of the moment numbered by trips."""
    axes = view_axes(CAMERA, edge)
    for caustic in caustics:
        ax.plot(*unrolled_curve(caustic.sky, axes, edge, True).T, **style.order_line(caustic.order), linewidth=0.9)
    style.log_axis(unrolled_axes(ax), 0.35, 90, ticks=9)
    ax.set(xlim=(140, 220))
    ax.xaxis.set_major_locator(MultipleLocator(20))
    trip = 0
    for index, rows in images.items():
        ax.plot(rows[:, 1], rows[:, 2], **style.index_line(index))
        dots = at_moment(rows)[:, 1:3]
        ax.plot(*dots.T, **DOT, color=style.index_colour(index), zorder=3)
        names = [str(trip + i) for i in range(len(dots))]
        number_images(ax, dots, names, np.array([(-11, 0)] * len(dots)), style.index_colour(index))
        arrows(ax, rows)
        trip += len(dots)
    return ax


def arrows(ax: Axes, rows: np.ndarray) -> None:
    """Heads that point the way an image moves, half-way between the dots."""
    look = {"arrowstyle": "-|>", "linewidth": 0, "shrinkA": 0, "shrinkB": 0, "color": "black", "mutation_scale": 9}
    for trip in at_moment(rows)[:, 0]:
        at = np.array([-0.5, -0.47]) + trip
        tail, head = zip(*(np.interp(at, rows[:, 0], rows[:, i]) for i in (1, 2)), strict=True)
        ax.annotate("", head, tail, arrowprops=look, zorder=4)


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=3), kc.shadow_edge(CAMERA, 2000)
    tracks = kc.star_tracks(CAMERA, STAR, max_index=2)
    images = {index: sinking(tracks, index, edge) for index in (1, 2)}
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.2), layout="constrained")
        grid = figure.add_gridspec(2, 2)
        sky = left_edge(figure.add_subplot(grid[:, 0]), images, caustics, edge)
        sky.set_title("(a) left edge of the shadow; dots: one moment")
        distance, latitude = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
        for index, rows in images.items():
            dots = at_moment(rows)
            for ax, column in ((distance, 2), (latitude, 3)):
                line, mark = style.index_line(index), {**DOT, "color": style.index_colour(index)}
                ax.plot(rows[:, 0], np.abs(rows[:, column]), **line, label=f"image of index {index}")
                ax.plot(dots[:, 0], np.abs(dots[:, column]), **mark)
        style.log_axis(distance, 0.5, 60, ticks=5)
        distance.set(ylabel="distance to shadow edge (deg)", title="(b) the images sink")
        latitude.set(ylabel="angle from the plane (deg)", ylim=(0, 28), title="(c) latitude, below and above the plane")
        for ax in (distance, latitude):
            ax.set_xlabel("prograde trips of the light, −φ′/360 deg")
        handles = [*distance.get_legend_handles_labels()[0]]
        for caustic, line in zip(caustics, sky.lines, strict=False):
            line.set_label(f"{style.order_name(caustic.order)} critical curve")
            handles.append(line)
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
        figure.suptitle(f"star at θ′ = {math.degrees(STAR):.6g} deg; {headline(caustics)}")
    return write_line_art(figure, output, "images_sink")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
