"""
Stars shine steadily
====================

The light of two images of a star while the camera turns slowly, 100 frames over three pixels: all of it (left), and
what the pixel in the middle gets (right), the same for both. In grey the bound of 2 % that JTFT set themselves.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.spacetime.sphere import from_angles

CAMERA = kc.Camera(spin=0.999, radius=6.03)
STAR = (1.2, 0.7)
FRAMES, PIXELS, WIDTH = 100, 25, 0.004


def shift(frame: int) -> tuple[float, float]:
    """By how many pixels the camera has turned: to the right, and less upward."""
    return 3.0 * frame / FRAMES - 1.5, 0.8 - 1.7 * frame / FRAMES


def light_of(sky: np.ndarray, star: kc.skies.StarField) -> np.ndarray:
    """Of each frame: all light, and that of the pixel in the middle."""
    found, still = [], kc.pictures.View(PIXELS, PIXELS, WIDTH, forward=sky)
    middle = (PIXELS - 1) / 2
    for frame in range(FRAMES):
        right, down = shift(frame)
        view = kc.pictures.View(PIXELS, PIXELS, WIDTH, forward=still.directions(middle + right, middle + down)[0])
        light = luminance(kc.render(CAMERA, view, star).light)
        x, y = np.meshgrid(np.arange(PIXELS), np.arange(PIXELS))
        light = light * view.solid_angle(view.directions(x, y)[1])
        found.append((light.sum(), light[PIXELS // 2, PIXELS // 2]))
    return np.array(found)


def panel(ax: Axes, values: list[np.ndarray], labels: list[str]) -> None:
    moved = [shift(frame)[0] for frame in range(FRAMES)]
    for number, (value, label) in enumerate(zip(values, labels, strict=True)):
        ax.plot(moved, value, color=f"C{number}", lw=1.2, label=label)
    ax.set_xlim(-1.5, 1.5)
    ax.set_xlabel("turn of the camera (pixels)")


def main(output: Path) -> list[Path]:
    catalogue = kc.skies.StarCatalogue(from_angles(*STAR)[None], np.zeros(1), np.full(1, 0.65))
    star = kc.skies.StarField(catalogue, orientation=np.eye(3), band=0)
    images = kc.star_images(CAMERA, star=STAR, max_index=1)
    light = [light_of(sky, star) for sky in images.sky]
    labels = [f"magnification {value:.3g}" for value in images.magnification]
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.0), layout="constrained")
        total, middle = figure.subplots(1, 2)
        panel(total, [part[:, 0] / part[:, 0].mean() for part in light], labels)
        total.axhspan(0.98, 1.02, color="0.9", zorder=0)
        total.set_ylim(0.96, 1.04)
        total.set_ylabel("light of all pixels (mean 1)")
        total.legend(fontsize="small")
        panel(middle, [part[:, 1] / part[:, 0].mean() for part in light], labels)
        middle.set_ylabel("part that one pixel gets")
        theta, phi = (style.number(math.degrees(angle), ".1f") for angle in STAR)
        camera = f"spin {CAMERA.spin}, radius {CAMERA.radius}, circular orbit"
        figure.suptitle(f"star at θ′ = {theta}, φ′ = {phi} deg; {camera}")
    return [write_picture(figure, output / "star_steadiness.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
