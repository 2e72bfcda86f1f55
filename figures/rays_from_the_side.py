"""Rays in a plane through the spin axis
=====================================

Left: rays of a camera at r = 30 M, 10 degrees above the equatorial plane of a hole without spin, in the plane through
the camera and the axis, which they do not leave, seen from the side: one colour for each Morse index, captured rays
grey. Right: those that reach a disk from r = 4 to r = 10, drawn as far as the disk, one colour for each crossing of its
plane: passing over the hole or in front of it, from below, and round the hole to the top face.
"""

import math
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.titles import viewer_in_words

CAMERA = kc.Camera(spin=0.0, radius=30, inclination=math.radians(80), velocity="static")
DISK = 4.0, 10.0
REACH = 13.5
CROSSINGS = {1: "first crossing", 2: "second crossing", 3: "third crossing"}


def fan(count: int, half_width: float) -> np.ndarray:
    """Directions (count, 3) in the plane through the hole's direction and the spin axis."""
    up = np.radians(np.linspace(-half_width, half_width, count))
    return np.stack([-np.cos(up), 0 * up, np.sin(up)], axis=-1)


def draw_rays(ax: plt.Axes) -> None:
    """All rays, past the hole and into it."""
    kc.ray_paths(CAMERA, fan(45, 18.0), 400).plot(ax, plane="xz")
    ax.set_title(viewer_in_words(CAMERA))


def draw_disk_rays(ax: plt.Axes) -> None:
    """The rays that meet the disk, at each crossing those that have not met it before."""
    sky, left = fan(2001, 20.0), np.ones(2001, bool)
    for crossing in CROSSINGS:
        end = kc.EquatorialPlane(crossing)
        radius = kc.trace_rays(CAMERA, sky, end=end).radius
        there = np.flatnonzero(left & (radius >= DISK[0]) & (radius <= DISK[1]))
        left[there] = False
        images = np.split(there, np.flatnonzero(np.diff(there) > 1) + 1)
        some = [image[np.linspace(0, len(image) - 1, min(5, len(image))).astype(int)] for image in images]
        paths = kc.ray_paths(CAMERA, sky[np.concatenate(some)], 400, end=end)
        paths.plot(ax, plane="xz", disk=DISK, colour=style.crossing_colour(crossing))
    lines = [Line2D([], [], color=style.crossing_colour(n), label=name) for n, name in CROSSINGS.items()]
    ax.legend(handles=lines)
    ax.set_title(f"disk from r = {DISK[0]:g} to {DISK[1]:g} M")


def main(output: Path) -> list[Path]:
    """The files, made in an existing folder."""
    with plt.rc_context(style.RC):
        figure, axes = plt.subplots(1, 2, figsize=(10.5, 5.0), layout="constrained", sharey=True)
        draw_rays(axes[0])
        draw_disk_rays(axes[1])
        for ax in axes:
            ax.set(xlim=(-REACH, REACH), ylim=(-REACH, REACH))
        axes[1].set_ylabel("")
        path = output / "rays_from_the_side.png"
        figure.savefig(path, dpi=200)
    plt.close(figure)
    return [path]


if __name__ == "__main__":
    folder = Path(__file__).parent / "out"
    folder.mkdir(exist_ok=True)
    main(folder)
