"""
Magnification over the camera sky
=================================

How much brighter a star appears in each direction of the camera sky than it would in empty space, at r = 6.03 and r =
2.6 round a hole of spin 0.999. The magnification is unbounded on the critical curves, and falls off toward the shadow.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture
from kerrcaustics.draw.scenes import show_critical_curves, show_picture

SPIN = 0.999
# Radii, and fields of view in degrees.
FIELDS = {6.03: 150, 2.6: 230}
SIZE = 480
# Powers of ten, shown as a colour.
RANGE = Normalize(-3, 2)
COLOURS = "YlOrBr_r"


def panel(ax: Axes, camera: kc.Camera, field: float) -> None:
    view = kc.pictures.View.toward_hole(camera, SIZE, SIZE, math.radians(field), "fisheye")
    x, y = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    sky, _ = view.directions(x, y)
    beams = kc.trace_beams(camera, sky, index=False, crossings=False, redshift=False)
    shade = ScalarMappable(RANGE, COLOURS).to_rgba(np.log10(beams.magnification), bytes=True)[..., :3]
    show_picture(ax, view, np.where(beams.escaped[..., None], shade, 0).astype(np.uint8), middle="shadow's middle")
    show_critical_curves(ax, view, kc.caustics(camera, orders=3), linewidth=0.7)


def main(output: Path) -> list[Path]:
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.6), layout="constrained")
        axes = figure.subplots(1, 2)
        for ax, (radius, field) in zip(axes, FIELDS.items(), strict=True):
            panel(ax, kc.Camera(SPIN, radius), field)
            ax.set_title(f"camera sky, radius {radius}")
        figure.suptitle(f"spin {SPIN}, inclination 90 deg, circular orbits")
        axes[1].set_ylabel("")
        bar = figure.colorbar(ScalarMappable(RANGE, COLOURS), ax=axes, shrink=0.8, pad=0.02, extend="both")
        bar.set_label("magnification")
        bar.set_ticks(range(-3, 3), labels=[f"$10^{{{power}}}$" for power in range(-3, 3)])
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return [write_picture(figure, output / "magnification_map.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
