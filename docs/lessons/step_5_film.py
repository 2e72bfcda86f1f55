"""
5. A film
=========

A film is described by a scene file, a few lines of text. We write one, look at some of its pictures, and make the film.
"""

# %%
# The scene
# ---------
#
# A file can hold everything from the last lessons: the hole, the camera, the view, the sky. ``film`` sets how long the
# film is. The camera goes round once in ten seconds.

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import kerrcaustics as kc

SCENE = """
hole = {spin = 0.999}
camera = {radius = 6.03}
view = {width = 320, height = 180, field_of_view_deg = 110}
sky = {kind = "stars"}

[film]
frames = 240
rate = 24
end = 99.3139  # one orbit of this camera
"""
folder = Path(tempfile.mkdtemp())
(folder / "orbit.toml").write_text(SCENE)
scene = kc.SceneFile.read(folder / "orbit.toml")
scene

# %%
# Some of its pictures
# --------------------

figure, panels = plt.subplots(2, 2, figsize=(7, 4.2), layout="constrained")
for ax, number in zip(panels.flat, (0, 60, 120, 180), strict=True):
    ax.imshow(scene.picture(number))
    ax.set_title(f"frame {number}", fontsize="small")
    ax.set_axis_off()
plt.show()

# %%
# The stars drift past. Outside the primary critical curve they all go one way; inside it they circle round two
# places, one on either side of the shadow, at which the poles of the turning sky are seen.
#
# The film
# --------
#
# In a terminal,
#
# .. code-block:: text
#
#     kerrcaustics film orbit.toml --output orbit.mp4
#
# makes all 240 frames; if it is interrupted, the same command resumes it. In Python, any function that returns a
# picture can make a film. Here is a two-second GIF of a star that crosses the secondary caustic, with its images up to
# index 2.

import math

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from kerrcaustics.films.film import Film, make_film

camera = kc.Camera(spin=0.999, radius=6.03)
caustics = kc.caustics(camera, orders=2)


def frame(number):
    """The star at its place in this frame, and its images."""
    drawn = Figure(figsize=(6, 3), dpi=80, layout="constrained")
    left, right = drawn.subplots(1, 2)
    star = math.radians(77), math.radians(-58 - 0.4 * number)
    caustics.plot(left, sky="camera")
    kc.star_images(camera, star, max_index=2).plot(left)
    left.set(xlim=(-60, 100), ylim=(-80, 80))
    left.get_legend().remove()
    caustics.plot(right)
    # On these axes φ′ runs from 0 to 360.
    right.plot(math.degrees(star[1]) % 360, math.degrees(star[0]), "k*")
    left.set_title("camera sky")
    right.set_title("celestial sphere")
    drawn.suptitle("spin 0.999, r = 6.03")
    canvas = FigureCanvasAgg(drawn)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


made = make_film(folder / "crossing.gif", Film("crossing", {"camera": "6.03"}, frames=20, rate=10, draw=frame))
made

# %%
plt.figure(figsize=(7, 3.5), layout="constrained").add_subplot().imshow(frame(12))
plt.axis("off")
plt.show()

# %%
# Where to go next
# ----------------
#
# The `first page <../index.html>`_ has a few lines for each task; `Scene files <../scene_files.html>`_ lists all that
# a scene can contain; `Films <../films.html>`_ has ready-made films. All terms introduced here are in the `glossary
# <../glossary.html>`_.
