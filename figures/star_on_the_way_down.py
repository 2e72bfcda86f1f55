"""
A star seen on the way down
===========================

A camera on circular orbits descends from r = 12 to r = 2.6 in the equatorial plane of a hole of spin 0.999. A star is
followed on its sky, always at the same angle from the camera round the spin axis: its images drift as the shadow grows.
The secondary caustic winds further and further round the celestial sphere, and when it comes to the star, near r = 5,
two images are born, one of index 1 and one of index 2 (triangles); the third triangle is an image of index 2 whose
partner has index 3 and is not followed. Dots mark where the images are at the end, and numbers beside the outermost
image the radius of the camera.
"""

import math
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator
from scipy.interpolate import CubicSpline

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.projection import about_shadow
from kerrcaustics.draw.sky_axes import camera_sky_axes

SPIN, HIGHEST, LOWEST, MOMENTS = 0.999, 12.0, 2.6, 22
# How often the step in which an image is born is halved: next to its birth it moves as a square root of time.
HALVINGS = 6
NAMED = (12, 8, 6, 4, 3)
STAR, MAX_INDEX = (math.radians(75), math.radians(-140)), 2
BORN = {"marker": "^", "color": "black", "markerfacecolor": "white", "zorder": 3}
LAST = {"marker": "o", "markersize": 3.5}


def strands(before: tuple[np.ndarray, ...]) -> list[list[tuple[int, int]]]:
    """Moment and number of an image and of all those that continue it, for each image that is new."""
    found, last = [], []
    for moment, links in enumerate(before):
        now = []
        for number, link in enumerate(links.tolist()):
            strand = last[link] if link >= 0 else []
            if link < 0:
                found.append(strand)
            strand.append((moment, number))
            now.append(strand)
        last = now
    return found


def with_births(radii: np.ndarray) -> np.ndarray:
    """Radii, and more of them next to those at which images are born."""
    count = [images_at(radius) for radius in radii]
    for high, low, before in zip(radii[:-1], radii[1:], count[:-1], strict=True):
        if images_at(low) != before:
            for _ in range(HALVINGS):
                middle = math.sqrt(high * low)
                radii = np.append(radii, middle)
                high, low = (middle, low) if images_at(middle) == before else (high, middle)
    return np.sort(radii)[::-1]


@cache
def images_at(radius: float) -> int:
    """How many images the star has."""
    return len(kc.star_images(kc.Camera(SPIN, float(radius)), STAR, MAX_INDEX))


def draw_images(sky: Axes, light: Axes, radii: np.ndarray, images: tuple[kc.StarImages, ...], strand: list) -> None:
    places = np.array([about_shadow(images[moment].camera, images[moment].sky[number]) for moment, number in strand])
    bright = np.array([images[moment].magnification[number] for moment, number in strand])
    when = np.log(radii[[moment for moment, _ in strand]])
    first, index = strand[0][0], int(images[strand[0][0]].index[strand[0][1]])
    line = style.index_line(index)
    # Behind its birth an image moves, and fades, by powers of the time that has passed.
    moved = np.log(when[0] - when + (when[0] - when[1]) / 2) if first > 0 else -when
    fine = np.linspace(moved[0], moved[-1], 400)
    curve = CubicSpline(moved, np.column_stack([places, np.log(bright), when]))(fine)
    sky.plot(*curve[:, :2].T, **line)
    sky.plot(*places[-1], color=line["color"], **LAST)
    light.plot(np.exp(curve[:, 3]), np.exp(curve[:, 2]), **line)
    if first > 0:
        sky.plot(*places[0], **BORN)
        light.plot(radii[first], bright[0], **BORN)
    if index == 0:
        for radius in NAMED:
            place = curve[np.argmin(np.abs(curve[:, 3] - math.log(radius))), :2]
            sky.plot(*place, ".", color=line["color"], markersize=4)
            sky.annotate(f"r = {radius}", place, (5, 0), textcoords="offset points", va="center")


def main(output: Path, moments: int = MOMENTS) -> list[Path]:
    radii = with_births(np.geomspace(HIGHEST, LOWEST, moments))
    cameras = [kc.Camera(SPIN, float(radius)) for radius in radii]
    followed = kc.follow_star(cameras, STAR, MAX_INDEX)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.4), layout="constrained")
        sky, light = figure.subplots(1, 2, width_ratios=[1.35, 1])
        last, first = (about_shadow(camera, kc.shadow_edge(camera, 2000)) for camera in (cameras[-1], cameras[0]))
        sky.fill(*last.T, label="last shadow", **style.SHADOW)
        sky.fill(*first.T, label="first shadow", **{**style.SHADOW, "facecolor": "#b8b8b8"})
        for strand in strands(followed.before):
            draw_images(sky, light, radii, followed.images, strand)
        sky.set(title="camera sky")
        camera_sky_axes(sky, 60)
        light.set(xscale="log", yscale="log", xlabel="radius of the camera (M)", ylabel="magnification")
        light.invert_xaxis()
        light.xaxis.set_major_locator(FixedLocator([12, 8, 6, 4, 3]))
        light.xaxis.set_minor_locator(NullLocator())
        light.xaxis.set_major_formatter("{x:g}")
        light.set_title("brightness of the images")
        lines = [Line2D([], [], label=f"index {k}", **style.index_line(k)) for k in range(MAX_INDEX + 1)]
        lines.append(Line2D([], [], linestyle="", label="image is born", **BORN))
        lines.append(Line2D([], [], linestyle="", color="gray", label="last place", **LAST))
        handles = [*sky.get_legend_handles_labels()[0], *lines]
        figure.legend(handles=handles, loc="outside lower center", ncols=4)
        theta, phi = (f"{math.degrees(angle):g}".replace("-", "−") for angle in STAR)
        way = f"radius {HIGHEST:g} to {LOWEST:g}, inclination 90 deg, circular orbits"
        figure.suptitle(f"spin {SPIN}, {way}; star at θ′ = {theta}, φ′ = {phi} deg")
    return write_line_art(figure, output, "star_on_the_way_down")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
