"""
Caustics that wind round the sky
================================

The tertiary and the fourth-order caustic for a = 0.999 and cameras on the equator at r = 6.03 and r = 2.6, with φ′
unwrapped: every faint vertical line marks one more turn round the celestial sphere. Letters mark the cusps. The paper
has no such figure; it counts "more than six" turns for the tertiary caustic at r = 2.6.

The tertiary caustics make 5.21 and 6.28 circuits, those of fourth order 14.77 and 16.18. All of the winding is in the
two long folds that meet at cusp A, and comes from rays that go round the hole close to its prograde photon orbit.
"""

from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_line_art
from kerrcaustics.draw.plots import celestial_sphere

SPIN = 0.999
RADII = (6.03, 2.6)


def main(output: Path) -> list[Path]:
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 6.4), layout="constrained")
        panels = iter(figure.subplots(2 * len(RADII), 1))
        for radius in RADII:
            for caustic in kc.caustics(kc.Camera(SPIN, radius), orders=4)[2:]:
                ax = celestial_sphere(next(panels), caustic)
                ax.set_title(
                    f"{style.order_name(caustic.order)} caustic, r = {radius}: {caustic.circuits:.2f} circuits"
                )
        figure.suptitle(f"spin {SPIN}, inclination 90 deg")
    return write_line_art(figure, output, "caustics_unwrapped")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
