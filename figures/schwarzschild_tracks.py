"""
Star tracks without spin
========================

The stars of the Hipparcos-2 catalogue seen from a circular orbit round a hole without spin. Two of them are picked out,
a bright one (red circles; Capella, of magnitude 0.2) and a dim one (yellow diamonds; Muscida, of magnitude 3.5), each
seen twice, outside the Einstein ring (violet) and inside it, on opposite sides of the shadow: the dashed line of the
same colour joins the two images of a star through the direction of the hole. The lines are the tracks of both stars
over an orbit, one colour for each star, with arrows that show which way the images move; within the marks they are left
out. The brighter a star, the wider its halo. Remakes JTFT figure 2.

The paper's: no spin, the camera's radius of 30 (following JTFT), two stars with two images each, in marks of these
shapes and colours, the ring, tracks that close along the shadow. Ours: which stars these are, and the star field, which
is from the Hipparcos-2 catalogue. The camera's speed of 0.19 c crowds the sky on the right, so that the joining lines,
straight for a camera at rest, bend a little. Images outside the ring stream past the hole; those inside come out of one
side of the shadow, swing round it in the opposite sense, and go down on the other side. The film of the same name shows
one orbit.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.palettes import INDEX_ON_BLACK
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant
from kerrcaustics.draw.star_maps import curve_handle, tracks_on_stars
from kerrcaustics.draw.titles import headline
from kerrcaustics.spacetime.frame import line_of_sight_from_sky, sky_from_fido

CAMERA = kc.Camera(spin=0.0, radius=30)
SKY = kc.skies.StarField()
# Name, number in the catalogue, which is sorted by brightness, marker and colour.
STARS = (("bright star", 6, "o", INDEX_ON_BLACK[0]), ("dim star", 270, "D", INDEX_ON_BLACK[1]))
VIEW = 45.0
# Of the marks, points of type.
MARK = 15.0


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=1), kc.shadow_edge(CAMERA, 2000)
    stars = [star_angles(number) for _, number, _, _ in STARS]
    tracks = [kc.star_tracks(CAMERA, theta, max_index=1) for theta, _ in stars]
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.9), layout="constrained")
        ax = figure.add_subplot()
        axes = tracks_on_stars(ax, tracks, caustics, edge, SKY, VIEW, colours=[colour for *_, colour in STARS])
        for (*_, marker, colour), star in zip(STARS, stars, strict=True):
            draw_star(ax, axes, star, marker, colour)
        handles = [*mark_handles(9), curve_handle("Einstein ring")]
        figure.legend(handles=handles, loc="outside lower center", ncols=2, labelspacing=0.9)
        angles = " and ".join(f"{math.degrees(theta):.1f}" for theta, _ in stars)
        figure.suptitle(f"stars at θ′ = {angles} deg; {headline(caustics)}")
    return write_line_art(figure, output, "schwarzschild_tracks")


def star_angles(number: int) -> tuple[float, float]:
    """theta' and phi' of a star of the catalogue as it stands on the sky; phi' counts from the camera."""
    x, y, z = SKY.orientation @ SKY.catalogue.direction[number]
    return math.acos(z), math.atan2(y, x)


def mark(marker: str) -> dict[str, Any]:
    """An open mark, in which the image of the star is seen."""
    return {"marker": marker, "markersize": MARK, "markerfacecolor": "none", "markeredgewidth": 1.6}


def mark_handles(size: float) -> list[Line2D]:
    """The handles of the marks for a legend, so many points large."""
    labels = [
        f"{name}, magnitude {SKY.catalogue.magnitude[number]:.1f}: images and tracks" for name, number, *_ in STARS
    ]
    looks = [{"color": colour, **mark(marker), "markersize": size} for *_, marker, colour in STARS]
    return [Line2D([], [], label=label, **look) for label, look in zip(labels, looks, strict=True)]


def draw_star(ax: Axes, axes: np.ndarray, star: tuple[float, float], marker: str, colour: str) -> None:
    """The two images of a star and the line that joins them."""
    images = kc.star_images(CAMERA, star, max_index=1)
    ax.plot(*azimuthal_equidistant(joined(images.sky), axes).T, color=colour, linewidth=1.0, linestyle=(0, (2, 2)))
    places = azimuthal_equidistant(images.sky, axes)
    uncover(ax, places)
    ax.plot(*places.T, color=colour, linestyle="none", zorder=4, **mark(marker))


def uncover(ax: Axes, places: np.ndarray) -> None:
    """Show the sky again above the lines within marks at places (n, 2), so that the stars in them are seen."""
    below = ax.get_images()[0]
    ax.apply_aspect()
    points = 72 * ax.get_window_extent().width / ax.get_figure(root=True).dpi
    radius = MARK / 2 / points * np.ptp(ax.get_xlim())
    for place in places:
        look = {"interpolation": "antialiased", "aspect": ax.get_aspect(), "zorder": 3}
        above = ax.imshow(below.get_array(), extent=below.get_extent(), **look)
        above.set_clip_path(Circle(tuple(place), radius, transform=ax.transData))


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
