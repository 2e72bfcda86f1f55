"""Pictures of volumes: glowing matter in space, before a sky."""

from time import perf_counter as clock

import numpy as np

from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.scenes.disk.march import Marching
from kerrcaustics.scenes.disk.veil import step_error, veil_of
from kerrcaustics.scenes.disk.volume import Volume
from kerrcaustics.scenes.raster import Raster, check_picture
from kerrcaustics.scenes.render import render
from kerrcaustics.scenes.scene_checks import check_number
from kerrcaustics.scenes.sky import Sky, check_sky
from kerrcaustics.spacetime.checks import flags, instance_of
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_LONGEST_STEP = 2.0


@result("volume-rendering/1")
class VolumeRendering(Shown):
    """Glowing matter in space, before a sky, as a camera sees it."""

    camera: Viewer = quantity("", "", "the camera or the observer", json="", column="")
    view: Raster = quantity("", "", "the part of its sky that is seen")
    light: Array = quantity("row column channel", "1", "linear sRGB intensity, float32; 0 for pixels that see nothing")
    transmission: Array = quantity("row column", "1", "part of the light behind it that the matter lets through")
    error: float = quantity(
        "", "1", "error of light, in parts of the brightest luminance, and of transmission, due to the steps"
    )
    supersampled: int = quantity("", "1", "pixels that were supersampled")
    rays: int = quantity("", "1", "rays marched")
    steps: int = quantity("", "1", "steps that all rays took")
    seconds: float = quantity("", "s", "time it took")

    def __repr__(self) -> str:
        """Return a line with size, camera, error and time."""
        size = f"{self.view.width} x {self.view.height}"
        return f"<VolumeRendering {size} of {self.camera}, error {self.error:.1g}, {self.seconds:.1f} s>"


@usual_warnings
@with_progress
def render_volume(
    camera: Viewer,
    view: Raster,
    volume: Volume,
    sky: Sky | None = None,
    *,
    beaming: bool = False,
    colour_shift: bool = False,
    step: float = 0.5,
    progress: Progress | bool | None = None,
) -> VolumeRendering:
    """Glowing matter in space, marched through along the ray of each pixel, and the sky behind it.

    Parameters
    ----------
    camera : Camera or Observer
    view : View or Screen
        As for `render`.
    volume : Volume
    sky : Sky, optional
        Seen as `render` shows it, dimmed by the matter in front.
    beaming, colour_shift : bool
        As for `render`; both together keep I_nu / nu^3.
    step : float
        Length of a step, at most 2, in lengths over which density and temperature change: `Volume.scale`, or the cells
        of a grid, or the width of the beam where that is more.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    VolumeRendering
        Its light becomes a picture by `tone_mapped`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `VolumeRendering.error`: 4/3 of the largest change that half the step makes to the rays of 256 pixels that see
    matter. Rays are those of the pixels' middles; pixels that differ from a neighbour by more than 1/24 of the
    brightest are the means of nine, which the error does not cover. Grids are averaged over the beam, functions are
    not.

    Notes
    -----
    Light is added front to back. The matter emits and absorbs at two of Gauss's places in each step: a step is exact
    where the matter does not change, of order 4 where the matter is thin, of order 2 where it is thick.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=30, inclination=1.3)
    >>> glow = kc.disks.Volume(0.1, 6504.0, inner=5.0, outer=8.0)
    >>> kc.pictures.render_volume(camera, kc.pictures.View(16, 9, 0.8), glow).light.shape
    (9, 16, 3)
    """
    began = clock()
    check_picture(camera, view)
    check_sky(sky)
    flags(beaming=beaming, colour_shift=colour_shift)
    marching = _checked(camera, volume, beaming, colour_shift, step)
    veil = veil_of(marching, view)
    error, shape = step_error(marching, view, veil), (view.height, view.width)
    light, transmission = (part.reshape(*shape, *part.shape[1:]) for part in veil.total())
    if sky is not None:
        behind = render(camera, view, sky, beaming=beaming, colour_shift=colour_shift)
        light = light + transmission[..., None] * behind.light
    seconds = clock() - began
    pictures = light.astype(np.float32), transmission.astype(np.float32)
    return VolumeRendering(camera, view, *pictures, error, *veil[2:], seconds)


def _checked(camera: Viewer, volume: Volume, beaming: bool, colour_shift: bool, step: object) -> Marching:
    instance_of("volume", volume, Volume)
    volume.check(camera.spin)
    must = f"be a number above 0 and at most {_LONGEST_STEP:g}"
    length = check_number("step", step, must, lambda number: 0 < number <= _LONGEST_STEP)
    return Marching(camera, volume, beaming, colour_shift, length)
