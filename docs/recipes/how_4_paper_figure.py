"""
Remake a figure of the paper
============================

**Goal:** a figure of JTFT (James, von Tunzelmann, Franklin & Thorne 2015), as it is and with another hole, in a form
that a journal can print.
"""

# %%
# As it is
# --------
#
# `Figures of the paper <../figures_of_the_paper.html>`_ lists the script for each figure. To make one of them, by its
# name, as PNG and PDF:
#
# .. code-block:: text
#
#     kerrcaustics figures caustics_near_the_hole --output .
#
# The scripts are short. To change one, copy it from ``figures/`` in a checkout.
#
# With numbers of your own
# ------------------------
#
# Figure 9 shows a critical curve and its caustic at r = 2.6, with letters at corresponding points. Here it is
# for a spin of 0.9. ``style.RC`` sets the fonts and lines of the project's own figures; ``PAGE_WIDTH`` is the width of
# a journal page.

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw import style

camera = kc.Camera(spin=0.9, radius=2.6, velocity="fiducial")
caustics = kc.caustics(camera, orders=2)
secondary = caustics[1]

with plt.rc_context(style.RC):
    figure, (sky, sphere) = plt.subplots(1, 2, figsize=(style.PAGE_WIDTH, 3.2), layout="constrained")
    caustics.plot(sky, sky="camera")
    secondary.plot(sphere)
    sky.set_title("(a) critical curves on the camera sky")
    sphere.set_title("(b) the secondary caustic")
    figure.suptitle("spin 0.9, r = 2.6, fiducial camera")
plt.show()

# %%
# What to look at
# ---------------
#
# In (a) the critical curves crowd toward the shadow, more so at higher order. The four tips in (b) are cusps,
# lettered along the curve; the long one points back along the direction in which the hole drags the light. Here are the
# numbers for a caption or a table, with errors:

for cusp in secondary.cusps:
    theta, phi = np.degrees(cusp.celestial)
    print(f"cusp at theta' = {theta:.6f} deg, phi' = {phi:.6f} deg")
print(f"widths {np.degrees(secondary.theta_extent):.6f} by {np.degrees(secondary.phi_extent):.6f} deg,", end=" ")
print(f"error {np.degrees(secondary.error):.0e} deg, {secondary.circuits:.4f} circuits")

# %%
# ``figure.savefig("figure_9.pdf")`` writes a PDF, which stays sharp at any size; for a talk, use
# ``figure.savefig("figure_9.png", dpi=200)``. In the caption, state the hole's spin and the camera, and cite JTFT.
