"""Caustics on the celestial sphere
================================

The caustics of orders 1 to 4 of a camera at r = 6.03 M, as they wind round the celestial sphere, seen from outside.

Writes a picture (PNG), a model (glTF) and a page on which the model can be rotated with the mouse (HTML).
"""

from pathlib import Path

import kerrcaustics as kc
from kerrcaustics.draw.solids import celestial_model
from kerrcaustics.draw.space import write_model


def main(output: Path) -> list[Path]:
    """The files, made in an existing folder."""
    caustics = kc.caustics(kc.Camera(spin=0.999, radius=6.03), orders=4)
    return write_model(celestial_model(caustics), output, "space_celestial_sphere")


if __name__ == "__main__":
    folder = Path(__file__).parent / "out"
    folder.mkdir(exist_ok=True)
    main(folder)
