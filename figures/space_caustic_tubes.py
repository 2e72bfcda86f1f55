"""Caustic tubes
=============

The caustics of a camera's past light cone, from the hole out to the celestial sphere: the primary tube, thin as a
thread, and the secondary one, which the hole's spin winds round it. Every point is a conjugate point of a ray. The
radius is drawn as r / (r + r_c). The tubes are cut off at r = 2, the ergosphere: further in they wind round the hole
closer and closer.

Writes a picture (PNG), a model (glTF) and a page on which the model can be rotated with the mouse (HTML).
"""

from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.solids import tubes_model
from kerrcaustics.draw.space import write_model


def main(output: Path) -> list[Path]:
    """The files, made in an existing folder."""
    camera = kc.Camera(spin=0.999, radius=6.03)
    return write_model(tubes_model(camera, kc.caustic_tubes(camera, orders=2)), output, "space_caustic_tubes")


if __name__ == "__main__":
    folder = Path(__file__).parent / "out"
    folder.mkdir(exist_ok=True)
    main(folder)
