"""
Stars shine steadily
====================

The light of two images of a star while the camera turns slowly, 100 frames over three pixels: by how much the total
light differs from its mean (left), which is far less than the bound of 2 % set in JTFT; and how much light the pixel in
the middle gets (right), which is the same for both.
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
from kerrcaustics.draw.titles import viewer_in_words
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


def panel(ax: Axes, values: list[np.ndarray], labels: list[str], widths: tuple[float, float]) -> None:
    moved = [shift(frame)[0] for frame in range(FRAMES)]
    for number, (value, label, width) in enumerate(zip(values, labels, widths, strict=True)):
        ax.plot(moved, value, **style.index_line(number), lw=width, label=label)
    ax.set_xlim(-1.5, 1.5)
    ax.set_xlabel("turn of the camera (pixels)")


def main(output: Path) -> list[Path]:
    catalogue = kc.skies.StarCatalogue(from_angles(*STAR)[None], np.zeros(1), np.full(1, 0.65))
    star = kc.skies.StarField(catalogue, orientation=np.eye(3), band=0)
    images = kc.star_images(CAMERA, star=STAR, max_index=1)
    light = [light_of(sky, star) for sky in images.sky]
    pairs = zip(images.index, images.magnification, strict=True)
    labels = [f"index {index}, magnification {value:.3g}" for index, value in pairs]
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.2), layout="constrained")
        total, middle = figure.subplots(1, 2)
        panel(total, [100 * np.abs(part[:, 0] / part[:, 0].mean() - 1) for part in light], labels, (1.1, 1.1))
        total.axhline(2, color="#555555", linewidth=0.9, linestyle=(0, (4, 2)))
        total.annotate("bound of JTFT", (0, 2), (0, -4), textcoords="offset points", ha="center", va="top")
        total.set(yscale="log", ylim=(1e-8, 5), ylabel="change of the light of all pixels (%)")
        # The first one shows behind the second one, which is the same.
        panel(middle, [100 * part[:, 1] / part[:, 0].mean() for part in light], labels, (3.2, 1.1))
        middle.set(ylim=(0, None), ylabel="light that one pixel gets (%)")
        figure.legend(*total.get_legend_handles_labels(), loc="outside lower center", ncols=2)
        theta, phi = (style.number(math.degrees(angle), ".1f") for angle in STAR)
        figure.suptitle(f"star at θ′ = {theta}, φ′ = {phi} deg; {viewer_in_words(CAMERA)}")
    return [write_picture(figure, output / "star_steadiness.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
