"""
2. A hole, a camera, a critical curve
=====================================

A black hole bends light. We put a camera next to one that spins, follow its lines of sight to the stars, and find where
a narrow beam of light is squeezed to a line.
"""

# %%
# The camera
# ----------
#
# ``spin`` runs from 0 to just below 1. ``radius`` is in units of the hole's mass, expressed as a length. The horizon of
# a fast-spinning hole is at 1, and nothing comes back from inside it; "far away" means 100 or more. By default the
# camera sits in the plane of the hole's equator and moves on a circular orbit. Angles are in radians everywhere in
# Python.

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

camera = kc.Camera(spin=0.999, radius=6.03)
camera

# %%
# The picture shows the hole's *shadow*: the directions from which no light comes, since lines of sight in these
# directions end in the hole. The shadow is not in the middle: the camera moves, which shifts all directions forward,
# just as rain seems to come from ahead when you run, and the hole drags light round with it.
#
# Lines of sight
# --------------
#
# A direction on the camera's sky is a unit vector. Its three components are those outward from the hole, along the
# motion, and up along the spin axis: (−1, 0, 0) points at the hole. ``trace_beams`` follows lines of sight, and narrow
# beams about them, back to the *celestial sphere*: the sky full of stars, infinitely far away.
#
# ``direction`` gives the place on the celestial sphere from which the light of a line of sight comes, ``error`` how far
# off that may be, in radians, and ``magnification`` how much brighter a star there looks than it would without the
# hole. Here are three lines of sight.

beams = kc.trace_beams(camera, [[-0.7, -0.1, 0.7], [-0.7, 0.1, 0.7], [-0.7, 0.6, 0.0]])
for number in range(3):
    print(beams.direction[number], "±", beams.error[number], "magnified", beams.magnification[number])

# %%
# The third line of sight ends in the hole: nothing comes from there, and its numbers are ``nan``, "not a number".
#
# Now take a series of directions along a line on the sky, from far to the right of the hole to its shadow. A narrow
# round beam of lines of sight lands on the celestial sphere as an ellipse. ``delta_minus`` is the smaller of its two
# diameters, divided by the diameter of the beam at the camera; it is negative where the picture is mirrored. The
# smaller the ellipse, the larger everything inside it appears, and the brighter a star there.

angle = np.radians(np.linspace(150, 68, 1500))
line = np.stack([-np.cos(angle), np.sin(angle), np.full_like(angle, 0.05)], axis=-1)
line /= np.linalg.norm(line, axis=1, keepdims=True)
seen = kc.trace_beams(camera, line)

figure, ax = plt.subplots(figsize=(6, 3), layout="constrained")
ax.plot(np.degrees(angle), seen.delta_minus)
ax.axhline(0, color="black", linewidth=0.6)
ax.set(xlabel="to the right of the hole (deg)", ylabel="smaller diameter of the beam", ylim=(-2, 2))
ax.invert_xaxis()
plt.show()

# %%
# ``delta_minus`` passes through zero again and again as we approach the shadow. Each zero is a point of a *critical
# curve*: the beam about this direction lands as a line, with no width, just as light does on the coffee.
#
# Why again and again? A line of sight that passes closer to the hole is bent more. Close to the shadow it runs round
# the hole once, twice, or any number of times before it leaves for the stars. About every half turn its beam is
# squeezed to a line and opens again: paths round a ball that start at one point meet at the opposite point, half a turn
# later, as meridians do at the poles. ``index`` counts how often this happens on the way. It is 0 far from the shadow
# and grows by one across each critical curve, beyond which one more squeeze happens before the end of the path. Where
# ``index`` is odd, the picture is mirrored.

for index in range(3):
    inside = seen.index == index
    print(f"index {index}: {np.degrees(angle[inside]).max():.2f} to {np.degrees(angle[inside]).min():.2f} deg")

# %%
# The first critical curves and caustics
# --------------------------------------
#
# ``caustics`` finds the zeros in all directions, to the last digit that the computer can represent, and joins them
# into curves. There are infinitely many such curves, since lines of sight may run round the hole any number of times.
# They are numbered from the outside inward by their *order*: the *primary* curve lies between index 0 and 1, the
# *secondary* between 1 and 2, the *tertiary* between 2 and 3, and so on.

caustics = kc.caustics(camera, orders=3)
ax = caustics.plot(sky="camera")
plt.show()

# %%
# These *critical curves* on the camera's sky, round the shadow, show where to look. The lines of sight in these
# directions land among the stars, on the *caustics*: each point of the primary critical curve has its point on the
# primary caustic, and so on for the other orders.

caustics.plot()
plt.show()

# %%
# The primary caustic is tiny, half a degree wide, on the far side of the hole. If the hole did not spin, this caustic
# would be a single point, exactly behind the hole; the spin drags light along, and pulls the point apart. Light that
# runs round the hole more often is dragged further: the tertiary caustic winds five times round the whole sky. Here are
# the number of turns and the error of each caustic:

for caustic in caustics:
    print(f"{caustic.order}: {caustic.kind}, {caustic.circuits:.4f} circuits, error {caustic.error:.0e} rad")

# %%
# Each caustic has four tips, called *cusps*; the bright line in the cup has one. Everywhere else a caustic is a *fold*.
# When a star crosses a fold, two images meet and vanish, or are born, depending on which way it goes. When it leaves
# through the very tip of a cusp, three images meet, and only one is left.

caustics[0].plot()
plt.show()

# %%
# The sky is folded
# -----------------
#
# Take a small grid of directions across the secondary critical curve, long in the direction in which the beam is
# squeezed, short in the other one. (``jacobian`` is the matrix that says where a small step on the camera's sky
# lands; its singular vectors are the two directions.) Where does the grid land on the celestial sphere? There we
# measure distances from one point of the caustic, along the caustic and across it.

from kerrcaustics.draw.style import index_colour

secondary = caustics[1]
number = len(secondary.sky) // 5
point, place, after = secondary.sky[number], secondary.celestial[number], secondary.celestial[number + 1]


def from_place(theta, phi):
    """Displacements of places on the celestial sphere along and across the caustic, in milliradians."""
    turn = (phi - place[1] + np.pi) % (2 * np.pi) - np.pi
    away = np.stack([theta - place[0], np.sin(place[0]) * turn])
    along = (after - place) * [1, np.sin(place[0])]
    along /= np.linalg.norm(along)
    return 1e3 * np.tensordot([along, [-along[1], along[0]]], away, 1)


basis = np.array(kc.tangent_basis(point))
stretched, squeezed = np.linalg.svd(kc.trace_beams(camera, point).jacobian)[2] @ basis
right, up = np.meshgrid(np.linspace(-1e-4, 1e-4, 9), np.linspace(-0.01, 0.01, 61), indexing="ij")
grid = point + right[..., None] * stretched + up[..., None] * squeezed
there = kc.trace_beams(camera, grid / np.linalg.norm(grid, axis=-1, keepdims=True))
along, across = from_place(np.arccos(there.direction[..., 2]), there.azimuth)

figure, (before, landed) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
for index in (1, 2):
    which, look = there.index == index, {"s": 6, "color": index_colour(index)}
    before.scatter(1e3 * right[which], 1e3 * up[which], label=f"index {index}", **look)
    landed.scatter(along[which], across[which], **look)
limits = landed.get_xlim(), landed.get_ylim()
landed.plot(*from_place(*secondary.celestial.T), color="black")
landed.set(xlim=limits[0], ylim=limits[1], xlabel="along the caustic (mrad)", ylabel="across it (mrad)")
landed.set_title("where it lands")
before.set(xlabel="mrad", ylabel="mrad", title="a grid on the camera's sky")
before.legend()
plt.show()

# %%
# This piece of the camera's sky is folded along the critical curve like a sheet of paper; the fold lies on the
# caustic (black). A star on one side of it lies under both layers: it is seen twice in this piece, once mirrored, in
# the layer that is turned over. A star on the other side is not seen in this piece at all, only elsewhere on the
# camera's sky.

# %%
# The numbers of a beam
# ---------------------
#
# You have met most of the numbers of a beam by now. When a result stands alone on the last line of a cell, the notebook
# shows all of its numbers: here, the smallest and the largest value of each for the first three lines of sight.
# ``index``, ``delta_minus`` and ``magnification`` are as above; ``parity`` is −1 where the picture is mirrored;
# ``redshift`` is the frequency that the camera sees divided by that of the source. The `Python reference
# <../api.html>`_ explains the rest.

beams
