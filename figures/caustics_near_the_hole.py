"""Caustics and critical curves of a = 0.999 at r = 6.03 and r = 2.6 (JTFT figs 4, 5, 8, 9), and of an inclined camera.

Writes figures/out/caustics_*.png and .pdf.
"""

import math
from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.plots import overview

OUT = Path(__file__).parent / "out"
CAMERAS = {
    "caustics_r6.03": kc.Camera(spin=0.999, radius=6.03),
    "caustics_r2.6": kc.Camera(spin=0.999, radius=2.6),
    "caustics_inclined": kc.Camera(spin=0.95, radius=4.0, inclination=math.radians(60)),
}


def main() -> None:
    OUT.mkdir(exist_ok=True)
    for name, camera in CAMERAS.items():
        picture = overview(kc.caustics(camera, orders=3), kc.shadow_edge(camera, 6000))
        for ending in ("png", "pdf"):
            picture.savefig(OUT / f"{name}.{ending}", dpi=150)
        print(f"  {OUT / name}.png, .pdf")


if __name__ == "__main__":
    main()
