"""
Aberration
==========

The paint swatches of the figure checkerboard, in the projection of its panel (b), seen by three cameras at one place, r
= 2.6 on the equator of a hole of spin 0.999: on a circular orbit; at rest with respect to the fiducial observer, which
the circular camera sees move backward at 0.546 of the speed of light; and at rest in Boyer-Lindquist coordinates
(static), which it sees move backward at 0.813. The red and black dot is the direction in which it sees the other two
move, away from the right part of the shadow. Remakes JTFT figure 12.

The paper's: hole, cameras, their velocities, the lensed swatches, the dot. Ours: the projection, longitude and latitude
about the direction in which the circular camera sees the middle of the shadow, the same on all three skies; and the
critical curves. All three see the same rays, so their pictures differ by aberration alone, which is exact here: the
faster a camera moves toward the dot, the more the sky crowds together there, and the larger the shadow, most of which
lies on the other side. For the three cameras it covers 0.45, 0.87 and 1.24 times the area of half the sky. The caustics
on the celestial sphere are the same for all three.

The flat edge of the shadow has a notch for the fiducial camera, within 27.0 degrees of the equatorial plane, and for
the static one, within 22.0 degrees: there the edge bends toward the shadow, and at the plane lies 2.8 and 4.7 degrees
inside the great circle from one end of the notch to the other. For the circular camera it bends outward everywhere.
White diamonds mark the ends of the notch.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.draw.scenes import show_critical_curves, show_picture
from kerrcaustics.scenes.checkerboard import HUES

SPIN, RADIUS = 0.999, 2.6
SKY = kc.skies.Checkerboard(rows=15, columns=32, colours=HUES, along="longitude")
# Toward the middle of the shadow of the circular camera, as in the checkerboard's figure.
MIDDLE = kc.pictures.View.toward_hole(kc.Camera(SPIN, RADIUS), 960, 480, 1.0)
VIEW = kc.pictures.View(960, 480, 2 * math.pi, "equirectangular", MIDDLE.forward, MIDDLE.up)
# Of the fiducial and the static camera, as the circular one sees them.
MOTION, EDGE_POINTS = np.array([0.0, -1.0, 0.0]), 4000


def main(output: Path) -> list[Path]:
    orbit = kc.Camera(SPIN, RADIUS).fido_velocity()[2]
    with rc_context(style.RC):
        figure = Figure(figsize=(5.2, 8.6), layout="constrained")
        for ax, velocity in zip(figure.subplots(3, 1), ("circular", "fiducial", "static"), strict=True):
            camera = kc.Camera(SPIN, RADIUS, velocity=velocity)
            own = camera.fido_velocity()[2]
            past = (own - orbit) / (1 - own * orbit)
            seen(ax, camera).set_title(velocity if past == 0 else f"{velocity}, {style.number(past, '.3f')} c")
        for ax in figure.axes[:2]:
            ax.set_xlabel("")
        figure.legend(*figure.axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        figure.suptitle(f"spin {SPIN}, radius {RADIUS}, inclination 90 deg\nvelocities relative to the circular camera")
    return [write_picture(figure, output / "aberration.png")]


def seen(ax: Axes, camera: kc.Camera) -> Axes:
    """The swatches as a camera sees them, critical curves, and the direction of motion."""
    picture = kc.pictures.tone_mapped(kc.render(camera, VIEW, SKY).light, exposure=1.0)
    show_picture(ax, VIEW, picture)
    show_critical_curves(ax, VIEW, kc.caustics(camera, orders=3), on_black=True, linewidth=1.3)
    look = {"markersize": 8, "color": "red", "markeredgecolor": "black", "markeredgewidth": 2.0, "linestyle": "none"}
    look["path_effects"] = [withStroke(linewidth=4.0, foreground="white")]
    ax.plot(
        *VIEW.pixels(MOTION),
        marker="o",
        label="motion of the other two",
        scalex=False,
        scaley=False,
        **look,
    )
    ends = notch(kc.shadow_edge(camera, EDGE_POINTS))
    if len(ends):
        look = {"marker": "D", "markersize": 5, "color": "white", "markeredgecolor": "black", "linestyle": "none"}
        ax.plot(*VIEW.pixels(ends).T, label="ends of the notch", scalex=False, scaley=False, **look)
    return ax


def notch(edge: np.ndarray) -> np.ndarray:
    """Ends of the notch about the first point of the shadow edge (n, 3): (2, 3), or (0, 3) for none."""
    tangent = np.roll(edge, -1, axis=0) - np.roll(edge, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    # Of the sign of the edge's geodesic curvature, positive where it bends round the shadow.
    bend = (edge * np.cross(tangent, np.roll(tangent, -1, axis=0) - np.roll(tangent, 1, axis=0))).sum(axis=1)
    first = int(np.argmax(bend > 0))
    return edge[[first, -first]] if first else np.empty((0, 3))


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
