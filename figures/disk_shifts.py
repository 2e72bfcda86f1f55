"""
A disk with its light shifted
=============================

The disk round a hole of spin 0.6: with its light unchanged; with its colours shifted, and its brightness kept; with
both shifted, as a camera sees it. On the left the gas comes toward the camera. Remakes JTFT figures 15a to c.

The paper's: the spin, which lights are shifted in which picture, disk and camera (following JTFT). Ours: that the
camera is at rest, the gas on circular geodesics, the wisps of the gas, and the colours that a black body has. Numbers
are the extremes of the frequency ratio over the first image.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.picture_files import write_picture

CAMERA = kc.Camera(spin=0.6, radius=74.1, inclination=math.radians(86.56), velocity="static")
VIEW = kc.pictures.View(1400, 630, math.radians(40))
GAS = kc.disks.Wisps(4500, inner=9.26, outer=18.70, depth=0.8, contrast=1.1)
DISK = kc.disks.Disk(GAS.inner, GAS.outer, GAS, opacity=GAS.opacity, slant=False)


def extremes() -> tuple[float, float]:
    """Least and largest ratio of frequencies, camera to gas, over the first image of the disk."""
    sky, _ = VIEW.directions(*np.meshgrid(np.arange(0, VIEW.width, 2), np.arange(0, VIEW.height, 2)))
    rays = kc.trace_rays(CAMERA, sky, end=kc.EquatorialPlane(1, DISK.motion), redshift=True)
    ratio = rays.redshift[(rays.radius > DISK.inner) & (rays.radius < DISK.outer)]
    return ratio.min(), ratio.max()


def main(output: Path) -> list[Path]:
    traced = kc.pictures.trace_view(CAMERA, VIEW, sky=False, disk=DISK)
    least, most = extremes()
    span = f"ν(camera)/ν(gas) from {least:.2f} to {most:.2f}"
    # Titles, switches, and what becomes white.
    panels = (
        ("light unchanged", {}, 0.25),
        (f"colours shifted: {span}", {"colour_shift": True}, 0.25),
        ("colours and brightness shifted, half the exposure", {"colour_shift": True, "beaming": True}, 0.50),
    )
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 10.05), layout="constrained")
        for ax, (title, shifts, white) in zip(figure.subplots(3, 1), panels, strict=True):
            ax.imshow(kc.pictures.tone_mapped(traced.show(disk=DISK, **shifts).light, exposure=1 / white))
            ax.set_axis_off()
            ax.set_title(title)
        place = f"radius {CAMERA.radius}, inclination {math.degrees(CAMERA.inclination):.2f} deg, static"
        figure.suptitle(f"spin {CAMERA.spin}, {place}; disk from r = {DISK.inner} to {DISK.outer} M")
    return [write_picture(figure, output / "disk_shifts.png")]


if __name__ == "__main__":
    OUT = Path(__file__).parent / "out"
    OUT.mkdir(exist_ok=True)
    print(*main(OUT), sep="\n")
