"""A trapped photon
================

An unstable photon orbit of constant radius round a hole of spin 0.999, on its sphere: it swings between two latitudes
while the hole drags it round (after figure 11 of JTFT). It is the orbit of the figure trapped_orbit, that of a ray at
the flat edge of the shadow seen from r = 2.6; one swing up and down takes 18 turns.

Writes a picture (PNG), a model (glTF) and a page on which the model can be rotated with the mouse (HTML).
"""

from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.solids import trapped_model
from kerrcaustics.draw.space import write_model

# b of the direction that the figure trapped_orbit follows.
IMPACT = 2.0691747


def main(output: Path) -> list[Path]:
    """The files, made in an existing folder."""
    orbit = kc.trapped_orbit(spin=0.999, impact=IMPACT, n=6000, oscillations=1)
    return write_model(trapped_model(orbit), output, "space_trapped_orbit")


if __name__ == "__main__":
    folder = Path(__file__).parent / "out"
    folder.mkdir(exist_ok=True)
    main(folder)
