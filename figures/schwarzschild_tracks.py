"""
Star tracks without spin
========================

A star field seen from a circular orbit round a hole without spin. Two stars are picked out, a bright one (white
circles) and a dim one (blue diamonds), each seen twice, outside the Einstein ring (violet) and inside it, on opposite
sides of the shadow: the dashed line of the same colour joins the two images of a star through the direction of the
hole. The lines are the tracks of both stars over an orbit, with arrows in the sense in which images move. Remakes JTFT
figure 2.

The paper's: no spin, the camera's radius of 30 (following JTFT), two stars with two images each in marks of this shape,
the ring, tracks that close along the shadow. Ours: which stars these are, and the stars of the field, those of the
Hipparcos-2 catalogue. The camera's speed of 0.19 c crowds the sky on the right, so that the joining lines, straight for
a camera at rest, bend a little. Images outside the ring stream past the hole; those inside come out of one side of the
shadow, swing round it in the opposite sense, and go down on the other side.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant
from kerrcaustics.draw.star_maps import star_map_legend, tracks_on_stars
from kerrcaustics.draw.titles import headline
from kerrcaustics.spacetime.frame import line_of_sight_from_sky, sky_from_fido

CAMERA = kc.Camera(spin=0.0, radius=30)
# Name, marker, colour, theta' and phi' relative to the camera, degrees.
STARS = (("bright star", "o", "#ffffff", 77, 165), ("dim star", "D", "#8fd3ff", 104, 168))
VIEW = 45.0


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=1), kc.shadow_edge(CAMERA, 2000)
    tracks = [kc.star_tracks(CAMERA, math.radians(theta), max_index=1) for _, _, _, theta, _ in STARS]
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.9), layout="constrained")
        ax = figure.add_subplot()
        axes = tracks_on_stars(ax, tracks, caustics, edge, kc.skies.StarField(), VIEW)
        marks = [draw_star(ax, axes, *star) for star in STARS]
        figure.legend(handles=[*star_map_legend(1), *marks], loc="outside lower center", ncols=3)
        figure.suptitle(f"stars at θ′ = {' and '.join(str(star[3]) for star in STARS)} deg; {headline(caustics)}")
    return write_line_art(figure, output, "schwarzschild_tracks")


def draw_star(ax: Axes, axes: np.ndarray, name: str, marker: str, colour: str, theta: float, phi: float) -> Line2D:
    """The two images of a star and the line that joins them; a handle for the legend."""
    images = kc.star_images(CAMERA, (math.radians(theta), math.radians(phi)), max_index=1)
    ax.plot(*azimuthal_equidistant(joined(images.sky), axes).T, color=colour, linewidth=1.0, linestyle=(0, (2, 2)))
    look = {"marker": marker, "markersize": 8, "color": colour, "markeredgecolor": "black", "linestyle": "none"}
    ax.plot(*azimuthal_equidistant(images.sky, axes).T, zorder=4, **look)
    return Line2D([], [], label=f"{name}, two images", **look)


def joined(sky: np.ndarray) -> np.ndarray:
    """Directions (n, 3) from one image to the other one through the hole: a great circle of an observer at rest."""
    frame = CAMERA.frame()
    # Photons move along -N.
    first, second = (-np.asarray(line_of_sight_from_sky(frame, one)) for one in sky)
    hole = np.array([1.0, 0.0, 0.0])
    part = np.linspace(0, 1, 40)[:, None]
    way = np.concatenate([(1 - part) * first + part * hole, (1 - part) * hole + part * second])
    return np.asarray(sky_from_fido(frame, way / np.linalg.norm(way, axis=1, keepdims=True)))


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
