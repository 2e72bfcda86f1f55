"""
A star of finite size at caustics
=================================

(a) to (d) A star with a radius of 3 degrees passes behind a hole without spin, whose primary caustic is a point: the
images of index 0 and 1 stretch into arcs, touch, and become an Einstein ring. (e) to (h) A star with a radius of 1
degree enters the secondary caustic of a hole of spin 0.999. The surroundings of the secondary critical curve are
unrolled: the position angle runs to the right, the distance from the curve upward. Once the caustic has reached the
star, part of the star has two more images, which form one shape across the critical curve, until the caustic has passed
over the star and the shape splits in two. (i) The light of stars of three sizes while they cross the secondary caustic,
and (j) the entrance enlarged: a point would be infinitely bright there. The light of a disc is finite; the smaller the
star, the brighter and shorter its flash.

The paper's: in (e) to (j) the hole, the camera on a circular orbit at r = 6.03, and the star at θ′ = 0.392 π; it says
of such images that they are lens-shaped and hug the ring. Ours: all numbers. Images up to index 2.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure, SubFigure
from scipy.interpolate import Akima1DInterpolator

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.source_images import source_images, unrolled_images

STILL = kc.Camera(spin=0.0, radius=10.0, velocity="fiducial")
OFFSETS = (9.0, 4.5, 2.0, 0.0)
"""Degrees from the axis."""
RING_STAR = math.radians(3.0)

FAST = kc.Camera(spin=0.999, radius=6.03)
THETA = 0.392 * math.pi
STAR = math.radians(1.0)
DEPTHS = (-1.3, -0.5, 0.5, 2.0)
"""Places of the centre, in radii of the star from where its path meets the caustic, positive inside."""
SIZES = (1.0, 0.3, 0.1)
"""Degrees."""


def main(output: Path) -> list[Path]:
    events = kc.pair_events(FAST, THETA, max_index=2)
    inside = sorted(event.star[1] for event in events)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 7.4), layout="constrained")
        rows = figure.subfigures(3, 1, height_ratios=(1.25, 1.0, 1.3))
        draw_ring(rows[0])
        draw_entrance(rows[1], inside[1], next(event.sky for event in events if event.kind == "creation"))
        draw_light(rows[2], *inside)
    return write_line_art(figure, output, "finite_star")


def draw_ring(row: SubFigure) -> None:
    """The star on its way to the axis of the hole without spin."""
    caustics = kc.caustics(STILL, orders=3)
    axes = row.subplots(1, 4, sharey=True)
    for ax, letter, offset in zip(axes, "abcd", OFFSETS, strict=True):
        star = math.pi / 2, math.pi + math.radians(offset)
        source_images(ax, kc.magnification(STILL, star, RING_STAR), caustics=caustics)
        ax.get_legend().remove()
        ax.set(xlim=(-62, 62), ylim=(-62, 62), aspect="equal", title=f"({letter}) {offset:g} deg from the axis")
        ax.set(xlabel="", ylabel="")
    axes[0].set_ylabel("deg")
    # Every label once, in the order of indices and orders.
    names = dict(zip(*reversed(axes[0].get_legend_handles_labels()), strict=True))
    names.pop("shadow", None)
    row.legend(names.values(), names, loc="outside lower center", ncols=3)
    row.suptitle("no spin, r = 10, a star with a radius of 3 deg")


def draw_entrance(row: SubFigure, edge: float, fold: np.ndarray) -> None:
    """The pair's images while the star enters; edge: phi' there; fold: where on the camera sky.

    Unrolled: by position angle, and by distance from the secondary critical curve.
    """
    critical = kc.caustics(FAST, orders=2)[1]
    axes = row.subplots(1, 4, sharex=True, sharey=True)
    for ax, letter, depth in zip(axes, "efgh", DEPTHS, strict=True):
        unrolled_images(ax, kc.magnification(FAST, (THETA, edge - depth * STAR), STAR), critical, fold)
        side = "inside" if depth > 0 else "outside"
        ax.set(title=f"({letter}) {abs(depth):g} radii {side}", xlim=(-28, 28), ylim=(-0.3, 0.3))
    axes[0].set_ylabel("deg from the\ncritical curve")
    row.supxlabel("position angle from the fold (deg)", fontsize=8.0)
    row.suptitle("a = 0.999, r = 6.03, a star with a radius of 1 deg at the secondary caustic")


def draw_light(row: SubFigure, start: float, end: float) -> None:
    """The light between and beside two crossings of the secondary caustic at azimuths start and end."""
    whole, near = row.subplots(1, 2, width_ratios=(1.4, 1))
    margin = math.radians(12)
    grid = np.linspace(start - margin, end + margin, 61)
    for k, size in enumerate(SIZES):
        radius = math.radians(size)
        close = radius * np.concatenate([np.linspace(-1.25, 1.25, 21), np.geomspace(1.4, 12, 8)])
        # The path meets the caustic at a small angle at the start: the star is long on it.
        azimuths = np.unique(np.concatenate([grid, start + 3 * close, end - close]))
        light = [kc.magnification(FAST, (THETA, phi), radius).total for phi in azimuths.tolist()]
        line = {"color": style.PALETTE[k], "label": f"{size:g} deg"}
        # The light is known to 1e-9: a curve without corners leads from place to place.
        fine = np.interp(np.arange(0, len(azimuths) - 1, 0.1), np.arange(len(azimuths)), azimuths)
        smooth = Akima1DInterpolator(azimuths, light, method="makima")(fine)
        whole.plot(np.degrees(fine), smooth, **line)
        near.plot(np.degrees(fine - end), smooth, **line)
    point = end - np.geomspace(1e-6, math.radians(4), 60)
    light = [kc.star_images(FAST, (THETA, phi), 2).magnification.sum() for phi in point.tolist()]
    near.plot(np.degrees(point - end), light, ":", color="black", label="a point")
    whole.set(xlabel="φ′ of the star relative to the camera (deg)", ylabel="magnification", title="(i) light")
    near.set(xlabel="φ′ from the caustic (deg)", xlim=(-3, 2), ylim=(1.2, 2.6), title="(j) at the caustic")
    near.legend(title="radius")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
