"""
A star's path through a caustic
===============================

(a) The primary and the secondary caustic on the celestial sphere, for a camera on a circular orbit at r = 6.03 round a
hole of spin 0.999, and the dashed path of a star that moves, relative to the camera, along its circle of latitude. It
enters the secondary caustic at A, where two of its images are created, and leaves it at B, where two are annihilated.
(b) The primary caustic, too small to be seen in (a), in its true shape. Remakes JTFT figure 5.

The paper's: hole, camera, A and B, and the star, 18 degrees above the equatorial plane: θ′ = 0.392 π, which JTFT counts
from the other pole as 0.608 π. Ours: the places of A and B, to the error of the caustic. For 42 of its 360 degrees the
star is inside the secondary caustic and has two more images, one of index 1 and one of index 2. It does not come near
the primary one.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.plots import primary_zoom
from kerrcaustics.draw.titles import headline
from kerrcaustics.tracks.events import PairEvents

CAMERA = kc.Camera(spin=0.999, radius=6.03)
STAR = 0.392 * math.pi
LETTERS = {"creation": ("A", (11, 7)), "annihilation": ("B", (-11, 7))}


def main(output: Path) -> list[Path]:
    caustics = kc.caustics(CAMERA, orders=2)
    events = kc.pair_events(CAMERA, STAR, max_index=2)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.3), layout="constrained")
        sphere, near = figure.subplots(1, 2, width_ratios=(2.1, 1))
        draw_path(sphere, caustics, events).set_title("(a) caustics, and the path of a star")
        primary_zoom(near, replace(caustics[0], cusps=())).set_title("(b) primary caustic")
        figure.legend(*sphere.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        figure.suptitle(f"star at θ′ = {math.degrees(STAR):.2f} deg; {headline(caustics)}")
    return write_line_art(figure, output, "star_through_caustic")


def draw_path(ax: Axes, caustics: CausticSet, events: PairEvents) -> Axes:
    """The caustics, the path with the direction of motion, and where it crosses the secondary one."""
    for caustic in caustics:
        line = np.degrees(np.concatenate([caustic.celestial, caustic.celestial[:1]]))
        name = f"{style.order_name(caustic.order)} caustic"
        ax.plot(line[:, 1], line[:, 0], label=name, **style.order_line(caustic.order))
    theta = math.degrees(STAR)
    ax.plot([0, 360], [theta, theta], "--", color="black", linewidth=0.9, label="path of the star")
    ax.annotate("", (18, theta), (38, theta), arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 0})
    for event in events:
        place = math.degrees(event.star[1]) % 360, theta
        letter, offset = LETTERS[event.kind]
        ax.plot(*place, "o", color="black", markersize=4)
        text = {"textcoords": "offset points", "ha": "center", "va": "center", "fontweight": "bold"}
        ax.annotate(letter, place, offset, **text)
    middle = np.degrees(caustics[0].celestial.mean(axis=0))
    ax.annotate("(b)", (middle[1], middle[0]), (0, 16), textcoords="offset points", ha="center",
                arrowprops={"arrowstyle": "-", "linewidth": 0.6})  # fmt: skip
    label = "φ′ relative to the camera (deg), seen from outside"
    ax.set(xlim=(0, 360), ylim=(150, 30), xlabel=label, ylabel="θ′ (deg)")
    ax.xaxis.set_major_locator(MultipleLocator(60))
    ax.yaxis.set_major_locator(MultipleLocator(30))
    return ax


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
