"""
Star tracks of a fast spinning hole
===================================

Paths of star images over the camera sky, for a = 0.999 and a camera on a circular orbit at r = 6.03. Every star goes
round once in an orbit; its image of index 0 moves outside the primary critical curve, that of index 1 inside, and
both circle the two images of a celestial pole, which stand still. Remakes JTFT figure 4.

As there: outside the primary critical curve stars drift from left to right over the picture, inside it images of
index 1 move back round the shadow in closed eddies round the images of the poles; no track crosses the primary
critical curve unless its star crosses the tiny primary caustic, so both kinds of track run along it.
"""

import math
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.files import write_line_art
from kerrcaustics.draw.plots import headline
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes
from kerrcaustics.draw.tracks import tracks_legend, tracks_on_sky

CAMERA = kc.Camera(spin=0.999, radius=6.03)
# Polar angles of the stars in degrees; the southern half of the sky mirrors the northern one.
STARS = (15, 35, 55, 70, 80, 87)
VIEW = 100.0


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=2), kc.shadow_edge(CAMERA, 2000)
    stars = [
        kc.star_tracks(CAMERA, math.radians(theta), max_index=1) for north in STARS for theta in (north, 180 - north)
    ]
    axes = view_axes(caustics, edge)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.6), layout="constrained")
        ax = tracks_on_sky(figure.add_subplot(aspect="equal"), stars, caustics, edge)
        for theta, name in ((0.0, "north"), (math.pi, "south")):
            poles = kc.star_images(CAMERA, (theta, 0.0), max_index=1)
            for place, index in zip(azimuthal_equidistant(poles.sky, axes), poles.index, strict=True):
                ax.plot(*place, marker="*", markersize=9, color=style.order_colour(index + 1), markeredgecolor="white")
                # Beside the star outside the ring, in the shadow inside it.
                offset = (8, 0) if index == 0 else (0, -20 if place[1] > 0 else 20)
                text = {"textcoords": "offset points", "va": "center", "fontsize": style.SMALLEST_TEXT}
                ax.annotate(f"{name} pole", place, offset, **text)
        ax.set_xlim(-VIEW, VIEW)
        ax.set_ylim(-VIEW, VIEW)
        figure.legend(handles=tracks_legend(1), loc="outside lower center", ncols=5)
        figure.suptitle(f"stars at θ′ = {', '.join(map(str, STARS))} deg, and mirrored\n{headline(caustics)}")
    return write_line_art(figure, output, "kerr_tracks_with_poles")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
