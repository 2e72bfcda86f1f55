"""
A checkerboard sky at r = 2.6
=============================

(a) A celestial sphere of paint swatches, whose hue varies with φ′ and whose brightness alternates. (b) What a camera on
a circular orbit at r = 2.6 round a hole of spin 0.999 sees of it: its whole sky, with the primary and the secondary
critical curve, 1cc and 2cc. (c) Its left part enlarged, from the primary curve to the flat edge of the shadow, with all
three curves, 1cc, 2cc and 3cc. Dashed lines run in the gaps between rows of swatches, at constant θ′: stars move along
them. Remakes JTFT figure 10.

The paper's: hole, camera, swatches with gaps and with a hue given by φ′, dashed tracks, names of the curves. Ours: the
number and the colours of the swatches, and the projections: longitude and latitude for the whole sky in (b); degrees in
(c) are measured from the middle of (b), which is the middle of the shadow. On a critical curve a small beam is
flattened to a line on the celestial sphere: there the swatches are stretched in one direction, which at the primary
curve is along the curve itself (within 0.6 degrees); across the curve the picture is mirrored. Next to the shadow the
whole sphere is seen again and again, between each curve and the next.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.draw.scenes import show_critical_curves, show_curve_names, show_line, show_picture
from kerrcaustics.draw.titles import headline
from kerrcaustics.scenes.checkerboard import HUES
from kerrcaustics.tracks.tracks import StarTracks

CAMERA = kc.Camera(spin=0.999, radius=2.6)
SKY = kc.skies.Checkerboard(rows=15, columns=32, colours=HUES, along="longitude")
DASHED = {"color": "black", "linewidth": 0.6, "linestyle": (0, (4, 2))}
# Of (c): from left to right, and what of it lies to the left of the prograde end of the shadow edge, radians.
FIELD, LEFT = math.radians(68), math.radians(60)


def flat_edge(width: int, height: int) -> kc.pictures.View:
    """The view of the equatorial plane from the primary critical curve to the prograde end of the shadow edge."""
    middle = kc.pictures.View.toward_hole(CAMERA, width, height, FIELD)
    left = kc.shadow_edge(CAMERA, 4)[0]
    inward = np.cross(np.cross(left, middle.forward), left)
    away = LEFT - FIELD / 2
    forward = left * math.cos(away) - inward / np.linalg.norm(inward) * math.sin(away)
    return kc.pictures.View(width, height, FIELD, forward=forward, up=middle.up)


def celestial_panel(ax: Axes) -> None:
    ax.imshow(
        kc.pictures.tone_mapped(kc.skies.celestial_picture(SKY, 400, mirror=True), exposure=1.0),
        extent=(0, 360, 180, 0),
    )
    for row in range(1, SKY.rows):
        ax.axhline(180 * row / SKY.rows, **DASHED)
    ax.xaxis.set_major_locator(MultipleLocator(90))
    ax.yaxis.set_major_locator(MultipleLocator(45))
    ax.set(xlabel="φ′ (deg)", ylabel="θ′ (deg)", title="(a) celestial sphere, seen from outside")


def seen(
    ax: Axes,
    view: kc.pictures.View,
    caustics: Sequence[kc.Caustic],
    stars: list[StarTracks],
    whole: kc.pictures.View | None,
) -> Axes:
    """The sky in a view, with tracks and critical curves; whole: the view from whose middle degrees count.

    Tracks end at the last of the curves.
    """
    picture = kc.pictures.tone_mapped(kc.render(CAMERA, view, SKY).light, exposure=1.0)
    show_picture(ax, view, picture, whole, "shadow's middle")
    for track in (track for star in stars for track in star.tracks):
        sky = np.where((track.index < len(caustics))[:, None], track.sky, np.nan)
        show_line(ax, view, np.concatenate([sky, sky[:1]]) if track.closed else sky, **DASHED)
    return show_critical_curves(ax, view, caustics, linewidth=1.7)


def main(output: Path) -> list[Path]:
    caustics = kc.caustics(CAMERA, orders=3)
    stars = [kc.star_tracks(CAMERA, math.pi * row / SKY.rows, max_index=2) for row in range(1, SKY.rows)]
    middle = kc.pictures.View.toward_hole(CAMERA, 800, 800, 1.0)
    whole = kc.pictures.View(1440, 720, 2 * math.pi, "equirectangular", middle.forward, middle.up)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 10.2), layout="constrained")
        celestial, wide, near = figure.subplots(3, 1, height_ratios=[0.8, 1.2, 1.2])
        celestial_panel(celestial)
        seen(wide, whole, caustics[:2], stars, None).set_title("(b) the whole camera sky")
        show_curve_names(wide, whole, caustics, {1: 110, 2: 172})
        close = flat_edge(1400, 660)
        seen(near, close, caustics, stars, whole).set_title("(c) left edge of the shadow")
        show_curve_names(near, close, caustics, {1: 165, 2: 40, 3: 22})
        handles = [*near.get_legend_handles_labels()[0], Line2D([], [], label="tracks of stars", **DASHED)]
        figure.legend(handles=handles, loc="outside lower center", ncols=4)
        figure.suptitle(headline(caustics))
    return [write_picture(figure, output / "checkerboard.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
