"""
All tracks of one star
======================

Every image of index 0 to 3 of one star over a whole orbit, for a = 0.999 and a circular orbit at r = 6.03: on the
camera sky (a), and with the distance to the shadow edge drawn out (b), where the tracks that hug the shadow come
apart. Triangles are the creations and annihilations of pairs, all of them on critical curves. Remakes JTFT figure 7.

As there, each connected track belongs to one order ε, the number of times its rays cross the equatorial plane: that
of order 0 stays outside the primary critical curve, that of order 1 crosses the secondary curve and comes back, that
of order 2 does so with the tertiary one, and so on: one critical curve each.
"""

import math
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.files import write_line_art
from kerrcaustics.draw.plots import headline
from kerrcaustics.draw.tracks import tracks_legend, tracks_on_sky, tracks_unrolled

CAMERA = kc.Camera(spin=0.999, radius=6.03)
STAR = math.radians(77)
MAX_INDEX = 3
# Position angle and distance in degrees where there is room for the name of an order.
LABELS = {0: (85, 55), 1: (280, 3.5), 2: (85, 0.22), 3: (315, 0.005)}


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=MAX_INDEX + 1), kc.shadow_edge(CAMERA, 6000)
    tracks = kc.star_tracks(CAMERA, STAR, MAX_INDEX)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.4), layout="constrained")
        sky, unrolled = figure.subplots(1, 2)
        tracks_on_sky(sky, tracks, caustics, edge).set_title("(a) camera sky")
        sky.set_aspect("equal")
        tracks_unrolled(unrolled, tracks, caustics, edge).set_title("(b) drawn out at the shadow edge")
        for track in tracks.tracks:
            order = int(kc.trace_beams(CAMERA, track.sky[len(track) // 2]).crossings)
            unrolled.annotate(f"ε = {order}", LABELS[order], ha="center", fontsize=style.SMALLEST_TEXT)
        figure.legend(handles=tracks_legend(MAX_INDEX), loc="outside lower center", ncols=4)
        figure.suptitle(f"star at θ′ = {math.degrees(STAR):.12g} deg; {headline(caustics)}")
    return write_line_art(figure, output, "all_tracks")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
