"""
Star tracks round a fast-spinning hole
======================================

The star field of a camera on a circular orbit at r = 6.03 round a hole of spin 0.999, and paths of star images over its
sky: of primary images in red, of the secondary images of other stars in yellow, with arrows that show which way they
move; the two critical curves in violet; and the four images of the two stars on the spin axis, which stand still, as
five-pointed stars in the colour of their tracks. Remakes JTFT figure 4.

The paper's: spin, camera, these colours and marks, what is drawn. Ours: the θ′ of the stars of either kind of track,
and the stars of the field, which are those of the Hipparcos-2 catalogue. Outside the primary critical curve stars drift
from left to right past the hole, those of the northern sky counter-clockwise round the upper image of a pole, the
southern ones clockwise round the lower one. Between the two curves images move the other way, in eddies: those of
northern stars clockwise round the lower image, which is the north pole's there. No track crosses the primary critical
curve unless its star crosses the tiny primary caustic, so both kinds of track run along it. Tracks that meet the
secondary curve end there: beyond it images have index 2.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant
from kerrcaustics.draw.star_maps import DARK_RIM, star_map_legend, tracks_on_stars
from kerrcaustics.draw.titles import headline
from kerrcaustics.tracks.tracks import StarTracks

CAMERA = kc.Camera(spin=0.999, radius=6.03)
# Polar angles of the stars in degrees, of primary and of secondary tracks; the southern half of the sky mirrors the
# northern one.
PRIMARY, SECONDARY = (15, 35, 55, 70, 80, 87), (20, 45, 65, 78, 86)
VIEW = 100.0


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=2), kc.shadow_edge(CAMERA, 2000)
    stars = [
        tracks_of_index(theta, index)
        for index, list_of_stars in enumerate((PRIMARY, SECONDARY))
        for north in list_of_stars
        for theta in (north, 180 - north)
    ]
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.9), layout="constrained")
        ax = figure.add_subplot()
        axes = tracks_on_stars(ax, stars, caustics, edge, kc.skies.StarField(), VIEW)
        for theta, name in ((0.0, "north pole"), (math.pi, "south pole")):
            poles = kc.star_images(CAMERA, (theta, 0.0), max_index=1)
            for place, index in zip(azimuthal_equidistant(poles.sky, axes), poles.index, strict=True):
                draw_pole(ax, place, int(index), name)
        figure.legend(handles=star_map_legend(1), loc="outside lower center", ncols=3)
        first, second = (", ".join(map(str, stars)) for stars in (PRIMARY, SECONDARY))
        names = f"{first} deg (primary), {second} deg (secondary)"
        figure.suptitle(f"stars at θ′ = {names},\nand mirrored; {headline(caustics)}")
    return write_line_art(figure, output, "kerr_tracks_with_poles")


def tracks_of_index(theta: float, index: int) -> StarTracks:
    """Tracks of the primary (0) or the secondary (1) images of a star at a polar angle in degrees."""
    tracks = kc.star_tracks(CAMERA, math.radians(theta), max_index=index)
    return replace(tracks, tracks=tuple(track for track in tracks.tracks if min(int(track.index.max()), 1) == index))


def draw_pole(ax: Axes, place: np.ndarray, index: int, name: str) -> None:
    """The image of a star on the spin axis; its name beside it outside the ring, in the shadow inside it."""
    colour = style.index_colour(index, on_black=True)
    ax.plot(*place, marker="*", markersize=14, color=colour, markeredgecolor="black", zorder=4)
    offset = (10, 0) if index == 0 else (0, -20 if place[1] > 0 else 20)
    text = {"textcoords": "offset points", "va": "center", "ha": "left" if index == 0 else "center"}
    ax.annotate(name, place, offset, color=colour, fontsize=8, path_effects=[DARK_RIM], **text)


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
