"""Renderings: pictures in linear light, the results of `render` and of `TracedView.show`."""

import math

import numpy as np

from kerrcaustics.results.declared import quantity, result
from kerrcaustics.results.shown import Shown
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

VISIBLE = "part of each pixel that is not in the shadow; None without a sky"
ERROR = "largest error of the map of the sky, in pixels; NaN without a sky"
SKY_RADIUS = "radius of the sphere with the sky"
STAGES = "seconds of each stage, by its name: disk_map, sky_map, shadow_edge, sky_light, stars, volume, disk_light"
BEAMS = "beams traced for the map, without those that find stars next to the shadow edge"
CROSSINGS = "beams traced to each crossing of the disk's plane, from the first one on"
_TRANSMISSION = "part of the light behind them that disk and volume let through; None without either"


@result("rendering/1")
class Rendering(Shown):
    """A sky, a disk and a volume, as a camera or an observer sees them."""

    camera: Viewer = quantity("", "", "the camera or the observer", json="", column="")
    view: Raster = quantity("", "", "the part of its sky that is seen")
    light: Array = quantity(
        "row column channel", "1", "linear sRGB intensity, float32, in the sky's unit; 0 for pixels that see nothing"
    )
    visible_fraction: Array | None = quantity("row column", "1", VISIBLE)
    supersampled: int = quantity("", "1", "pixels that were supersampled")
    beams: int = quantity("", "1", BEAMS)
    seconds: float = quantity("", "s", "time it took")
    crossings: tuple[int, ...] = quantity("crossing", "1", CROSSINGS, default=())
    transmission: Array | None = quantity("row column", "1", _TRANSMISSION, default=None)
    error: float = quantity("", "1", ERROR, default=math.nan)
    stages: dict[str, float] = quantity("", "s", STAGES, default=dict)
    sky_radius: float = quantity("", "GM/c^2", SKY_RADIUS, default=math.inf)

    @property
    def alpha(self) -> Float[Array, "height width"] | None:
        """Opacity (h, w) of disk and volume, for compositing in other programs; None with a sky.

        The shadow of the hole is not matter, and is as transparent as its surroundings.
        """
        if self.transmission is None or self.visible_fraction is not None:
            return None
        return 1 - self.transmission

    def __repr__(self) -> str:
        """Return a line with size, camera and time."""
        size = f"{self.view.width} x {self.view.height}"
        return f"<Rendering {size} of {self.camera}, {self.beams} beams, {self.seconds:.1f} s>"
