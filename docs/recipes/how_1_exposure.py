"""
Choose an exposure
==================

**Goal:** a picture that is neither white nor black. The light of a rendering has its own unit, and spans a factor of a
million from faint stars to a bright disk. The *exposure* is the factor by which it is multiplied before it is shown,
and the *curve* determines how much of that range a screen shows.
"""

# %%
# Four pictures of the same light
# -------------------------------
#
# ``render`` takes seconds, but showing its light again takes almost no time: render once, then experiment. With the
# default, ``exposure="auto"``, every function that shows light chooses an exposure to suit it; a number sets an
# exposure of your own.

import matplotlib.pyplot as plt

import kerrcaustics as kc

camera = kc.Camera(spin=0.999, radius=6.03)
view = kc.pictures.View.toward_hole(camera, width=320, height=240, field_of_view=2.4, projection="fisheye")
stars = kc.render(camera, view, kc.skies.StarField())

figure, panels = plt.subplots(2, 2, figsize=(7, 5.6), layout="constrained")
choices = {
    "exposure 1, linear": {"exposure": 1.0, "curve": "linear"},
    "exposure 1/2500, linear": {"exposure": 1 / 2500, "curve": "linear"},
    "exposure 1/2500, asinh": {"exposure": 1 / 2500, "curve": "asinh"},
    "auto, asinh": {"exposure": "auto", "curve": "asinh"},
}
for ax, (name, choice) in zip(panels.flat, choices.items(), strict=True):
    stars.plot(ax, **choice)
    ax.set_title(name)
    ax.set_axis_off()
figure.suptitle("Stars, spin 0.999, r = 6.03")
plt.show()

# %%
# What to look at
# ---------------
#
# At exposure 1 nearly everything is white: the light of a star field is in units of a star of magnitude 0 per
# steradian, and a pixel is a small part of a steradian. On the linear curve, bright enough light is clipped at white
# and loses its colour; ``asinh`` keeps the hue, lifts faint light and leaves room for bright light. Stars look best
# with ``asinh``, a disk or a checkerboard alone with ``linear``.
#
# A number of your own
# --------------------
#
# ``auto_exposure`` returns the exposure that would be chosen, and ``clipped_fraction`` the fraction of pixels that are
# clipped at white with a given exposure; more than a few per cent is too much. ``tone_mapped`` makes the bytes of a
# picture file.

exposure = kc.pictures.auto_exposure(stars.light, curve="asinh")
for stops in (-2, 0, 2):
    chosen = exposure * 2.0**stops
    clipped = kc.pictures.clipped_fraction(stars.light, chosen, curve="asinh")
    print(f"exposure {chosen:.2g}: {clipped:.2%} of the pixels are cut")
picture = kc.pictures.tone_mapped(stars.light, exposure=exposure, curve="asinh")

# %%
# ``kerrcaustics.draw.scenes.save_picture("stars.png", picture)`` writes it. Doubling the exposure adds one stop, as
# with a camera: change it by factors of two. Pictures that belong together need one number for all of them; in a film,
# the automatic exposure changes smoothly.
#
# In a scene file the exposure is in the table ``light``; values left out are chosen from the light, and
# ``kerrcaustics render`` prints the exposure and how much of the picture is clipped:
#
# .. code-block:: toml
#
#     [light]
#     exposure = 0.0004   # by default "auto"
#     curve = "asinh"     # the default with stars
#
# A disk in front of stars needs a ``brightness`` of a few hundred or more (the default is 600).
# ``kerrcaustics render scene.toml --output scene.exr`` keeps the light itself, before any exposure, for programs that
# process raw light. For more, see `Light and colour <../scenes.html#light-and-colour>`_ and `Exposure
# <../scene_files.html#exposure>`_.
