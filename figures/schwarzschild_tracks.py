"""
Star tracks without spin
========================

Left: paths of star images over the sky of a camera that circles a hole without spin at r = 6.03, with the first two
Einstein rings. Right: rays in the plane of the hole, the camera and a star, on the Schwarzschild coordinates r, phi;
a star seen on both sides of the hole, and the cones of rays that make the rings. Remakes JTFT figures 2 and 3.

Images outside the primary ring stream past the hole, from left to right; those inside it run on closed loops above and
below the equator, from right to left along the ring and back close to the shadow. The rays of ring k turn
through k times 180 degrees: the primary caustic is the line behind the hole, the secondary one the line behind the
camera, and a star on it is seen as a ring. The rings have impact parameters 6.4936 and 5.2540, the shadow 5.1962.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from scipy.integrate import solve_ivp

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes
from kerrcaustics.draw.tracks import tracks_legend, tracks_on_sky
from kerrcaustics.spacetime.camera import photon

CAMERA = kc.Camera(spin=0.0, radius=6.03)
STARS = (30, 55, 75, 84)
# The star of the rays, degrees from the camera round the hole; where rays leave the picture.
STAR, FAR = 150.0, 13.5
LABELS = {
    "camera": (6.5, -1.6),
    "primary\ncaustic": (-10.0, 0.6),
    "secondary\ncaustic": (7.9, 0.6),
    "to the star": (-6.0, 11.8),
}


def main(output: Path) -> list[Path]:
    caustics, edge = kc.caustics(CAMERA, orders=2), kc.shadow_edge(CAMERA, 2000)
    stars = [kc.star_tracks(CAMERA, math.radians(t), max_index=1) for north in STARS for t in (north, 180 - north)]
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.0), layout="constrained")
        sky, plane = figure.subplots(1, 2)
        tracks_on_sky(sky, stars, caustics, edge).set_title("camera sky, moving to the right")
        sky.set_aspect("equal")
        poles = kc.star_images(CAMERA, (0.0, 0.0), max_index=1)
        for place, index in zip(azimuthal_equidistant(poles.sky, view_axes(caustics, edge)), poles.index, strict=True):
            sky.plot(*place, marker="*", markersize=8, color=style.order_colour(index + 1), markeredgecolor="white")
            text = {"textcoords": "offset points", "ha": "center", "fontsize": style.SMALLEST_TEXT}
            sky.annotate("north pole", place, (0, 7 if index == 0 else 18), **text)
        draw_rays(plane, caustics).set_title("rays of a star (solid) and of the rings (dashed)")
        figure.legend(handles=tracks_legend(1)[:3], loc="outside lower center", ncols=3)
        figure.suptitle(
            f"spin 0, radius 6.03, circular orbit; stars at θ′ = {', '.join(map(str, STARS))} deg, and mirrored"
        )
    return write_line_art(figure, output, "schwarzschild_tracks")


def draw_rays(ax: Axes, caustics: kc.CausticSet) -> Axes:
    """The two images of a star, the rays of the Einstein rings, and the caustics that they come from."""
    ax.add_patch(Circle((0, 0), 2, **style.SHADOW))
    for caustic, far in zip(caustics, (-FAR, FAR), strict=True):
        colour = style.order_colour(caustic.order)
        ax.plot([math.copysign(2, far), far], [0, 0], color=colour, linewidth=4, alpha=0.25)
        for side in (-1, 1):
            ax.plot(*ray(caustic.sky[0], side), color=colour, linewidth=0.8, linestyle=(0, (4, 2)))
    images = kc.star_images(CAMERA, (math.pi / 2, math.radians(STAR)), max_index=1)
    for looking, azimuth, index in zip(images.sky, images.azimuth, images.index, strict=True):
        ax.plot(*ray(looking, math.copysign(1, azimuth)), color=style.order_colour(index + 1), linewidth=1.6)
    ax.plot(CAMERA.radius, 0, "ks", markersize=4)
    for text, place in LABELS.items():
        ax.annotate(text, place, fontsize=style.SMALLEST_TEXT)
    ax.set(xlim=(-FAR, FAR), ylim=(-FAR, FAR), aspect="equal", xlabel="r cos φ (M)", ylabel="r sin φ (M)")
    return ax


def ray(looking: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """A ray in its plane, from the camera outward: u'' = 3 u^2 - u with u = 1/r against the angle swept."""
    seen = photon(CAMERA.frame(), tuple(looking))
    start = [1 / CAMERA.radius, seen.rate[0] / math.sqrt(seen.k)]

    def leaves(_angle: float, state: np.ndarray) -> float:
        return state[0] - 0.5 / FAR

    leaves.terminal = True
    path = solve_ivp(lambda _, y: [y[1], 3 * y[0] ** 2 - y[0]], (0, 10), start, events=leaves, rtol=1e-9, max_step=0.03)
    return np.cos(path.t) / path.y[0], side * np.sin(path.t) / path.y[0]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
