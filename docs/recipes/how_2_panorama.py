"""
Show a 360° photo of your own
=============================

**Goal:** to use a panorama, such as a 360° photo, as the sky behind the hole. It must not come out mirrored, and you
choose which part of it lies behind the hole.

.. index:: 360, 360°, panorama
"""

# %%
# A picture to try
# ----------------
#
# A panorama is twice as wide as it is high: it spans the full circle of the horizon, and reaches from the north pole at
# the top to the south pole at the bottom. It shows the sky as seen from inside, as photographs do. Here is one with
# words, which show at once whether the sky is mirrored. To use a file instead: ``kc.skies.Panorama.read("sky.jpg")``.

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import kerrcaustics as kc

paper = Figure(figsize=(10, 5), dpi=100)
chart = paper.add_axes((0, 0, 1, 1), xlim=(0, 360), ylim=(-90, 90))
chart.imshow(np.linspace(0.15, 0.75, 256)[:, None], extent=(0, 360, -90, 90), aspect="auto", cmap="viridis", vmin=0)
for degrees, word in {0: "BACK", 90: "LEFT", 180: "AHEAD", 270: "RIGHT", 360: "BACK"}.items():
    chart.text(degrees, 4, word, color="white", size=34, ha="center", weight="bold")
for degrees in range(0, 361, 45):
    chart.axvline(degrees, color="white", linewidth=1)
FigureCanvasAgg(paper).draw()
picture = np.asarray(paper.canvas.buffer_rgba())[..., :3]
# A picture's bytes are not linear light; `read` takes care of that.
light = (picture / 255) ** 2.2

# %%
# Far from a hole, and near it
# ----------------------------
#
# The middle of the picture lies behind the hole for a camera at azimuth 0. From far away the words read as in the
# picture, bent round the hole; from a circular orbit at r = 6.03 the whole sky appears again, inside the ring.

sky = kc.skies.Panorama(light)
figure, panels = plt.subplots(3, 1, figsize=(6, 9), layout="constrained")
panels[0].imshow(picture)
panels[0].set_title("the panorama")
for ax, radius in ((panels[1], 100.0), (panels[2], 6.03)):
    camera = kc.Camera(spin=0.9, radius=radius)
    view = kc.pictures.View.toward_hole(camera, width=360, height=180, field_of_view=3.0, projection="fisheye")
    kc.render(camera, view, sky).plot(ax, exposure=1.0, curve="linear")
    ax.set_title(f"spin 0.9, r = {radius:g}")
for ax in panels:
    ax.set_axis_off()
plt.show()

# %%
# What to look at
# ---------------
#
# Words outside the bright ring read as they should. Words squeezed against its inner side are mirrored: they are images
# of index 1, between the primary and the secondary critical curve. A mirrored word far from the hole would mean that
# the picture is a chart of the sphere as seen from outside, like a globe; in that case ``mirror=True`` flips it.
#
# Turn the panorama
# -----------------
#
# ``orientation`` puts another place behind the hole. It is either one angle (to the right) or three (to the right, up,
# and clockwise), in radians.

turned = kc.skies.Panorama(light, orientation=np.radians(90.0))
camera = kc.Camera(spin=0.9, radius=100.0)
view = kc.pictures.View.toward_hole(camera, width=360, height=180, field_of_view=2.4, projection="fisheye")
ax = kc.render(camera, view, turned).plot(exposure=1.0, curve="linear")
ax.set_title("the right side of the panorama behind the hole")
plt.show()

# %%
# In a scene file:
#
# .. code-block:: toml
#
#     [sky]
#     kind = "panorama"
#     file = "sky.jpg"
#     mirror = false
#     orientation_deg = 90   # or [90, 0, 0]: to the right, up, clockwise
#
# Panoramas of 4096 by 2048 pixels or more are best: near the hole a part of the sky is magnified. FITS and HEALPix
# files can be read, too: `FITS and HEALPix <../results.html#fits-and-healpix>`_.
