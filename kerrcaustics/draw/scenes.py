"""Pictures of the sky seen through the hole: as files, and on axes with the critical curves."""

import os
import shutil
import tempfile
from typing import Any

import numpy as np
from jaxtyping import UInt8
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FixedLocator, FuncFormatter
from PIL import Image

from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import style
from kerrcaustics.draw.projection import smoothed
from kerrcaustics.files import writing
from kerrcaustics.scenes.view import View

Array = np.ndarray

# Over a picture of any colour a line needs a rim.
_CASING = [withStroke(linewidth=2.0, foreground="white", alpha=0.7)]


def save_picture(path: str | os.PathLike[str], picture: Array) -> None:
    """Write a picture (height, width, 3) uint8, as `tone_mapped` makes it, as PNG or JPEG, by the ending of `path`."""
    endings = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}
    ending = os.path.splitext(os.fspath(path))[1].lower()
    if ending not in endings:
        raise ValueError(f"Argument `path` must end in {', '.join(endings)}, but is {os.fspath(path)!r}.")
    picture = np.asarray(picture)
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3:
        raise ValueError("Argument `picture` must be an array (height, width, 3) of uint8.")
    with writing(path) as file:
        Image.fromarray(picture).save(file, endings[ending])


def save_light(path: str | os.PathLike[str], light: Array) -> None:
    """Write linear light (height, width, 3) as an OpenEXR file, single precision; needs the package of that name."""
    if os.path.splitext(os.fspath(path))[1].lower() != ".exr":
        raise ValueError(f"Argument `path` must end in .exr, but is {os.fspath(path)!r}.")
    try:
        import OpenEXR
    except ImportError:
        raise ImportError('OpenEXR pictures need the package OpenEXR: pip install "kerrcaustics[exr]"') from None
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    # The library writes to names alone.
    with tempfile.TemporaryDirectory() as folder, writing(path) as file:
        whole = os.path.join(folder, "light.exr")
        OpenEXR.File(header, {"RGB": np.ascontiguousarray(light, np.float32)}).write(whole)
        with open(whole, "rb") as made:
            shutil.copyfileobj(made, file)


def show_picture(ax: Axes, view: View, picture: UInt8[Array, "height width 3"]) -> Axes:
    """A picture (height, width, 3) uint8 of a view on axes, in pixels that are labelled as degrees from its centre.

    Degrees are true along the axes through the centre; for a fisheye view, along every line through it.
    """
    ax.imshow(picture, interpolation="antialiased", extent=(-0.5, view.width - 0.5, view.height - 0.5, -0.5))
    _degrees(ax, view)
    return ax


def show_critical_curves(ax: Axes, view: View, caustics: CausticSet, **line: Any) -> Axes:
    """Critical curves over a picture of the same view and camera, one colour an order, as lines in its pixels."""
    limits = ax.get_xlim(), ax.get_ylim()
    for caustic in caustics:
        curve = smoothed(caustic.sky) if caustic.closed else caustic.sky
        if caustic.closed:
            curve = np.concatenate([curve, curve[:1]])
        places = view.pixels(curve)
        # Where an equirectangular picture ends at one side and goes on at the other, the line is broken.
        jump = np.flatnonzero(np.abs(np.diff(places[:, 0])) > view.width / 2) + 1
        places = np.insert(places, jump, np.nan, axis=0)
        settings = {**style.order_line(caustic.order), "linewidth": 0.9, "path_effects": _CASING, **line}
        ax.plot(*places.T, label=style.order_name(caustic.order), **settings)
    ax.set_xlim(limits[0])
    ax.set_ylim(limits[1])
    return ax


def _degrees(ax: Axes, view: View) -> None:
    """Ticks at round angles from the centre."""
    ends = {}
    axes = np.stack([view.forward, view.right, view.up])
    for axis, row, size in ((ax.xaxis, 1, view.width), (ax.yaxis, 2, view.height)):
        middle = [(view.width - 1) / 2, (view.height - 1) / 2]
        middle[row - 1] = size - 0.5 if row == 1 else -0.5
        ends[row] = np.degrees(np.arccos(np.clip(view.directions(*middle)[0] @ axes[0], -1, 1)))
        step = style.tick_step(2 * ends[row], 7)
        angle = np.arange(-int(ends[row] / step + 1e-9), int(ends[row] / step + 1e-9) + 1) * float(step)
        turn = np.radians(angle)[:, None]
        places = view.pixels(np.cos(turn) * axes[0] + np.sin(turn) * axes[row])[:, row - 1]
        axis.set_major_locator(FixedLocator(places.tolist()))
        names = {round(float(place), 6): f"{value:g}" for place, value in zip(places, angle, strict=True)}
        axis.set_major_formatter(FuncFormatter(lambda place, _, names=names: names.get(round(float(place), 6), "")))
    ax.set_xlabel("to the right (deg)")
    ax.set_ylabel("up (deg)")
