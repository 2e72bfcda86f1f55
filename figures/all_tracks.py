"""
All tracks of one star
======================

Every image of index 0 to 3 of one star over a whole orbit, for a = 0.999 and a circular orbit at r = 6.03: for a star
18 degrees above the equatorial plane (a), and for one 1.8 degrees above it (b). Left: on the camera sky; right: with
the distance to the shadow edge drawn out on a logarithmic scale, which separates the tracks that hug the shadow. Arrows
point the way the images move; triangles mark the creations and annihilations of pairs, all of them on critical curves.
Remakes JTFT figure 7.

The paper's: hole, camera, two stars, at θ′ = 0.4 π and 0.49 π (JTFT counts them from the other pole, as 0.6 π and 0.51
π), labels ε. Ours: the drawn-out view and the colours, by Morse index. Each connected track belongs to one order ε, the
number of times its rays cross the equatorial plane: that of order 0 stays outside the primary critical curve, that of
order 1 crosses the secondary curve and comes back, that of order 2 does so with the tertiary one, and so on: one
critical curve each. The closer the star is to the plane, the closer its tracks follow the critical curves.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes
from kerrcaustics.draw.titles import headline
from kerrcaustics.draw.tracks import tracks_legend, tracks_on_sky, tracks_unrolled
from kerrcaustics.tracks.tracks import StarTracks

CAMERA = kc.Camera(spin=0.999, radius=6.03)
STARS = {"(a)": 0.4 * math.pi, "(b)": 0.49 * math.pi}
MAX_INDEX = 3
# Position angle and distance in degrees where there is room for the name of an order.
LABELS = {0: (90, 65), 1: (275, 4.5), 2: (90, 0.3), 3: (245, 0.006)}
# The same on the sky: degrees right of the middle of the shadow and above it.
SKY_LABELS = {0: (-48, 76), 1: (-24, -68), 2: (-3, 20), 3: (-3, -20)}


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=MAX_INDEX + 1), kc.shadow_edge(CAMERA, 6000)
    tracks: list[StarTracks] = []
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 7.6), layout="constrained")
        for panels, (letter, theta) in zip(figure.subplots(2, 2), STARS.items(), strict=True):
            name = f"{letter} star at θ′ = {math.degrees(theta):.1f} deg"
            tracks.append(kc.star_tracks(CAMERA, theta, MAX_INDEX))
            draw_star(*panels, tracks[-1], caustics, edge, name)
        figure.legend(handles=tracks_legend(tracks, True), loc="outside lower center", ncols=4)
        figure.suptitle(headline(caustics))
    return write_line_art(figure, output, "all_tracks")


def draw_star(sky: Axes, unrolled: Axes, tracks: StarTracks, caustics: CausticSet, edge: np.ndarray, name: str) -> None:
    """The tracks of one star in both views, with the orders of the tracks."""
    tracks_on_sky(sky, tracks, caustics, edge).set_title(name)
    axes = view_axes(CAMERA, edge)
    tracks_unrolled(unrolled, tracks, caustics, edge).set_title("drawn out at the shadow edge")
    for track in tracks.tracks:
        order = int(kc.trace_beams(CAMERA, track.sky[len(track) // 2]).crossings)
        unrolled.annotate(f"ε = {order}", LABELS[order], ha="center")
        name_on_sky(sky, azimuthal_equidistant(track.sky, axes), order)


def name_on_sky(ax: Axes, line: np.ndarray, order: int) -> None:
    """The order of a track (n, 2) on the camera sky, and a line from it to the nearest place of the track."""
    place = line[np.argmin(np.hypot(*(line - SKY_LABELS[order]).T))]
    leader = {"arrowstyle": "-", "color": "#606060", "linewidth": 0.6, "shrinkA": 0, "shrinkB": 1}
    ax.annotate(f"ε = {order}", tuple(place), SKY_LABELS[order], ha="center", va="center", arrowprops=leader)


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
