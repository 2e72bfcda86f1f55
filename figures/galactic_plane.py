"""
Images of the galactic plane
============================

How often the galactic plane is seen at r = 2.6 round a hole of spin 0.999: the images of that great circle over the
stars, one colour for each Morse index, between the three critical curves. (a) The camera sky; numbers in the shadow
count the images on the dashed lines, at the flat left edge, above and below. (b) The left edge; (c) the same with the
distance to the shadow edge drawn out on a logarithmic scale, which separates the images of index 2. The set-up is that
of JTFT figure 8, which has no such lines.

The paper's: hole, camera, critical curves, the question of how many images of the galactic plane lie between them, and
its answer, 2, 3 and 8 at the left edge, 1 and 1 above and below. Ours: the plane, inclined by 25 degrees as in our star
field, as the paper's is not known, and the counts, certified: 1, 4 and 11 at the left edge, 1 and 1 above, 0 and 1
below. The 1 counted at the left edge lies on the right, where the dashed line comes round from the back of the sky.
Another circle has other counts: docs/open_questions.md.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.circles import lines_of_counts
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.draw.projection import unrolled_curve, unrolled_places, view_axes
from kerrcaustics.draw.scenes import show_critical_curves, show_line, show_picture
from kerrcaustics.draw.sky_axes import unrolled_axes
from kerrcaustics.draw.titles import headline
from kerrcaustics.tracks.circles import CircleImages
from kerrcaustics.tracks.lines import LineCrossings, places_on_line

from .star_field import CAMERA, SKY, flat_edge

# Of the galactic plane in that sky: its tilt, and a quarter turn before its ascending node.
NORMAL = (math.radians(25), math.radians(-60 - 90))
MAX_INDEX = 2
LINE: dict[str, Any] = {"color": "white", "linewidth": 0.7, "linestyle": (0, (2, 2))}
DOT: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.2, "markeredgecolor": "black", "mew": 0.5}
# Degrees from the shadow's middle at which counts are written into it, to the right and up.
COUNTED = {"left edge": (-34, 0), "above": (0, 46), "below": (0, -46)}


def seen(
    ax: Axes, view: kc.pictures.View, caustics: CausticSet, circle: CircleImages, lines: dict[str, LineCrossings]
) -> Axes:
    """The stars in a view, with critical curves, the images of the circle, and those that are counted as dots."""
    whole = kc.pictures.View.toward_hole(CAMERA, 2, 2, 1.0, "fisheye")
    picture = kc.pictures.tone_mapped(kc.render(CAMERA, view, SKY).light, 1 / 2500, "asinh", softening=25)
    show_picture(ax, view, picture, whole, "shadow's middle")
    ax.set_facecolor("black")
    show_critical_curves(ax, view, caustics, on_black=True, linewidth=0.7, path_effects=[])
    for curve in circle.curves:
        sky = np.concatenate([curve.sky, curve.sky[:1]]) if curve.closed else curve.sky
        show_line(ax, view, sky, linewidth=0.8, **style.index_line(curve.index, True))
    for name, line in lines_of_counts(caustics).items():
        show_line(ax, view, places_on_line(circle, line), **LINE)
        for k in range(MAX_INDEX + 1):
            dots = lines[name].sky[lines[name].index == k]
            show_line(ax, view, dots, **DOT | {"color": style.index_colour(k, True), "zorder": 3})
    return ax


def write_counts(ax: Axes, view: kc.pictures.View, lines: dict[str, LineCrossings]) -> None:
    """The counts by index, in the colours of the indices, in the shadow beside the lines."""
    for name, (right, up) in COUNTED.items():
        angle = math.radians(math.hypot(right, up))
        across = (right * view.right + up * view.up) / math.hypot(right, up)
        place = view.pixels((math.cos(angle) * view.forward + math.sin(angle) * across)[None])[0]
        text: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "center", "color": "white"}
        ax.annotate(name, tuple(place), (0, 7), **text)
        counts = [(k, count) for k, count in lines[name].per_index.items() if k or name == "left edge"]
        for i, (k, count) in enumerate(counts):
            away = 16 * (i - (len(counts) - 1) / 2)
            look = {**text, "color": style.index_colour(k, True), "fontweight": "bold", "fontsize": 10}
            ax.annotate(str(count), tuple(place), (away, -6), **look)


def drawn_out(ax: Axes, caustics: CausticSet, circle: CircleImages, lines: dict[str, LineCrossings]) -> Axes:
    """Distance to the shadow edge, logarithmic, against position angle about the left edge."""
    edge = kc.shadow_edge(CAMERA, 2000)
    axes = view_axes(CAMERA, edge)
    ax.set_facecolor("black")
    for caustic in caustics:
        line = style.order_line(caustic.order, True)
        ax.plot(*unrolled_curve(caustic.sky, axes, edge, True).T, linewidth=0.8, **line)
    for curve in circle.curves:
        line = style.index_line(curve.index, True)
        ax.plot(*unrolled_curve(curve.sky, axes, edge, curve.closed).T, linewidth=1.0, **line)
    left = lines["left edge"]
    for k in range(MAX_INDEX + 1):
        dots = unrolled_places(left.sky[left.index == k], axes, edge)
        ax.plot(*dots.T, **DOT, color=style.index_colour(k, True), zorder=3)
    style.log_axis(unrolled_axes(ax), 0.3, 90, ticks=9)
    ax.axvline(180, zorder=1.5, **LINE)
    ax.set(xlim=(125, 235))
    ax.xaxis.set_major_locator(MultipleLocator(30))
    return ax


def main(output: Path) -> list[Path]:
    caustics = kc.caustics(CAMERA, orders=MAX_INDEX + 1)
    circle = kc.circle_images(CAMERA, NORMAL, MAX_INDEX)
    lines = {name: kc.crossings_of_line(circle, line) for name, line in lines_of_counts(caustics).items()}
    certified = circle.certified and all(line.certified for line in lines.values())
    whole = kc.pictures.View.toward_hole(CAMERA, 640, 500, math.radians(232), "fisheye")
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 9.3), layout="constrained")
        grid = figure.add_gridspec(2, 2, height_ratios=[1.6, 1])
        sky = seen(figure.add_subplot(grid[0, :]), whole, caustics, circle, lines)
        write_counts(sky, whole, lines)
        sky.set_title("(a) camera sky, with counts of images by index on the dashed lines")
        near = seen(figure.add_subplot(grid[1, 0]), flat_edge(360, 360, math.radians(24)), caustics, circle, lines)
        near.set_title("(b) left edge of the shadow")
        drawn_out(figure.add_subplot(grid[1, 1]), caustics, circle, lines).set_title("(c) drawn out at the left edge")
        images = [Line2D([], [], label=f"index {k}", **style.index_line(k, True)) for k in range(MAX_INDEX + 1)]
        look = {"facecolor": "black", "labelcolor": "white", "frameon": True}
        handles = [*sky.get_legend_handles_labels()[0], *images]
        figure.legend(handles=handles, loc="outside lower center", ncols=6, **look)
        verdict = "images and counts are certified" if certified else "NOT all of it is certified"
        figure.suptitle(f"galactic plane, inclined by 25 deg to the equatorial plane; {verdict}\n{headline(caustics)}")
    return [write_picture(figure, output / "galactic_plane.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
