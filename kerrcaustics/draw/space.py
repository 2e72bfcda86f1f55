"""Models in space by pyvista, which is imported here alone: plotters, and pictures as PNG."""

import functools
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kerrcaustics.draw.solid_files import write_gltf, write_html
from kerrcaustics.draw.solids import Model, Surface
from kerrcaustics.extras import needed
from kerrcaustics.scenes.picture_files import save_picture
from kerrcaustics.shapes import Float

if TYPE_CHECKING:
    import pyvista
else:
    pyvista = needed("space", "pyvista")

SIZE = (3200, 2400)
"""Pixels of a new plotter; a picture is half as large, so that its edges are smooth."""

PACKAGES = ("libegl1", "libegl-mesa0", "libgl1-mesa-dri")
"""Debian packages of the OpenGL that works without a screen."""

# What a picture needs of OpenGL; without it VTK does not raise, it ends the process.
_PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Sphere(), color="red")
assert plotter.screenshot(return_img=True).max() > 0
"""


class NoOpenGLError(RuntimeError):
    """Nothing can be drawn in three dimensions on this machine."""


@functools.cache
def check_opengl() -> None:
    """Raise `NoOpenGLError` where nothing can be drawn: tried once, in a process of its own."""
    _use_egl()
    try:
        works = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, timeout=120).returncode == 0
    except subprocess.TimeoutExpired:
        works = False
    if not works:
        raise NoOpenGLError(
            "No picture in three dimensions can be drawn here: OpenGL does not work. On Debian or Ubuntu install the "
            f"packages {', '.join(PACKAGES)}. Models are written as glTF and HTML without it."
        )


def draw_model(model: Model, plotter: pyvista.Plotter | None = None) -> pyvista.Plotter:
    """The plotter with the model in it, the given one or a new one off screen, looking at it.

    Raises
    ------
    NoOpenGLError
        Where this machine cannot draw in three dimensions.
    """
    check_opengl()
    view: Any = plotter
    if view is None:
        view = pyvista.Plotter(off_screen=True, window_size=list(SIZE), lighting="light kit")
        view.set_background("white")
    scale = view.window_size[1] / 1200
    azimuth, elevation = np.radians(model.look)
    towards = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    for line in model.lines:
        mesh = pyvista.lines_from_points(line.points)
        view.add_mesh(mesh, color=line.colour, line_width=scale * line.width, lighting=False)
    for surface in model.surfaces:
        view.add_mesh(_mesh(surface, towards), color=surface.colour, opacity=surface.opacity, ambient=0.2, specular=0.1)
    _add_texts(view, model, round(15 * scale))
    view.camera.position = tuple(4.2 * model.extent * towards)
    view.camera.focal_point = (0.0, 0.0, 0.0)
    view.camera.up = (0.0, 0.0, 1.0)
    view.camera.view_angle = 28.0
    view.reset_camera_clipping_range()
    return view


def _mesh(surface: Surface, towards: Float[np.ndarray, "3"]) -> pyvista.PolyData:
    """A surface as it is to be drawn for who looks at it from a direction."""
    places, corners = surface.points.reshape(-1, 3), surface.triangles()
    # The farthest first, so that what is translucent lets the rest show: the peeling of depths, which would do
    # without, loses translucent surfaces on some machines.
    corners = corners[np.argsort(places[corners].sum(axis=1) @ towards, kind="stable")]
    mesh = pyvista.PolyData(places, np.insert(corners, 0, 3, axis=1).ravel())
    mesh.point_data.active_normals = surface.normals()
    return mesh


def _add_texts(view: Any, model: Model, size: int) -> None:
    """The title above, the key below."""
    for row, (words, colour) in enumerate(reversed(model.key)):
        place = (0.02, 0.025 + 0.036 * row)
        view.add_text(words, position=place, viewport=True, font_size=size, color=colour, name=f"key {row}")
    place = (0.02, 0.955)
    view.add_text(model.title, position=place, viewport=True, font_size=size, color="black", name="title")


def write_png(model: Model, path: str | os.PathLike[str]) -> None:
    """The model as a picture of 1600 x 1200 pixels."""
    plotter: Any = draw_model(model)
    try:
        pixels = np.asarray(plotter.screenshot(return_img=True), float)
    finally:
        plotter.close()
    height, width = pixels.shape[0] // 2, pixels.shape[1] // 2
    smooth = pixels.reshape(height, 2, width, 2, 3).mean(axis=(1, 3)).round().astype(np.uint8)
    save_picture(path, smooth)


def write_model(model: Model, folder: Path, name: str) -> list[Path]:
    """The model in an existing folder as NAME.glb, NAME.html and, last, NAME.png; the paths of the three.

    Raises
    ------
    NoOpenGLError
        Where no picture can be drawn, when the other two are written.
    """
    paths = [folder / f"{name}{ending}" for ending in (".glb", ".html", ".png")]
    write_gltf(model, paths[0])
    write_html(model, paths[1])
    write_png(model, paths[2])
    return paths


def _use_egl() -> None:
    """Let VTK draw through EGL where there is no display."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
