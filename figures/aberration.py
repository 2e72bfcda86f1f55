"""
Aberration
==========

Shadow and critical curves for three cameras at one place, r = 2.6 on the equator of a hole of spin 0.999: at rest in
Boyer-Lindquist coordinates (static), at rest with respect to the fiducial observer, and on a circular orbit. Remakes
JTFT figure 12.

All three see the same rays, so their critical curves and shadows differ by aberration alone, which is exact here: the
faster a camera moves to the right, the more the sky crowds together there, and the smaller the shadow, most of which
lies on that side; the static camera, which moves to the left at 0.48 of the speed of light past the fiducial one,
sees it swell to more than half of the sky. The caustics on the celestial sphere are the same for all three.
"""

from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.files import write_line_art
from kerrcaustics.draw.projection import azimuthal_equidistant, smoothed

SPIN, RADIUS = 0.999, 2.6
# Rows forward, right, up: toward the hole (-e_r), along e_phi, along -e_theta, which all three cameras share.
AXES = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
VIEW = 165.0


def main(output: Path) -> list[Path]:
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.2), layout="constrained")
        panels = figure.subplots(1, 3, sharey=True)
        for ax, velocity in zip(panels, ("static", "fiducial", "circular"), strict=True):
            camera = kc.Camera(SPIN, RADIUS, velocity=velocity)
            ax.fill(*azimuthal_equidistant(kc.shadow_edge(camera, 2000), AXES).T, **style.SHADOW)
            for caustic in kc.caustics(camera, orders=3):
                curve = azimuthal_equidistant(smoothed(caustic.sky), AXES)
                ax.plot(*np.concatenate([curve, curve[:2]]).T, **style.order_line(caustic.order))
            speed = camera.fido_velocity()[2]
            ax.set_title(f"{velocity}, v = {speed:+.4f}".replace("-", "−") if speed else f"{velocity} observer, v = 0")
            ax.set(xlim=(-VIEW, VIEW), ylim=(-VIEW, VIEW), aspect="equal", xlabel="along φ, in the motion (deg)")
            ax.xaxis.set_major_locator(MultipleLocator(90))
            ax.yaxis.set_major_locator(MultipleLocator(90))
            ax.axvline(0, color=style.GUIDE_COLOUR, linewidth=0.5, zorder=0.5)
        panels[0].set_ylabel("up, along the spin axis (deg)")
        lines = [panels[0].plot([], [], label=style.order_name(k), **style.order_line(k))[0] for k in (1, 2, 3)]
        figure.legend(handles=lines, loc="outside lower center", ncols=3)
        figure.suptitle(f"spin {SPIN}, radius {RADIUS}, equator; v is measured by the fiducial observer")
    return write_line_art(figure, output, "aberration")


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
