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
# ``spin`` runs from 0 to just below 1. ``radius`` is in units of the hole's mass: the horizon of a hole that spins
# fast is at 1, far away is 100 and more. Without more words the camera sits in the plane of the hole's equator and
# moves on a circular orbit. Angles are radians everywhere in Python.

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

camera = kc.Camera(spin=0.999, radius=6.03)
camera

# %%
# The picture shows its *shadow*: directions from which no light comes, since lines of sight end in the hole. It does
# not lie in the middle: the camera moves, which shifts all directions, and the hole drags light round with it.
#
# Lines of sight
# --------------
#
# A direction of the camera's sky is a unit vector. Its parts are outward from the hole, along the motion, and up along
# the spin axis: (−1, 0, 0) looks at the hole. ``trace_beams`` follows lines of sight, and narrow beams about them, back
# to the *celestial sphere*: the sky full of stars, infinitely far away.

beams = kc.trace_beams(camera, [[-0.7, -0.1, 0.7], [-0.7, 0.1, 0.7], [-0.7, 0.6, 0.0]])
beams

# %%
# The third ray is captured. Of the others ``direction`` says from where on the celestial sphere their light comes,
# ``magnification`` how much brighter a star looks there, and ``error`` how far off the direction may be, in radians.
#
# Now look along a line from far to the right of the hole to its shadow. A round beam of the camera covers an ellipse on
# the celestial sphere; ``delta_minus`` is the smaller of its diameters, and negative where the image is a mirror image.

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
# It passes through zero, again and again the nearer we come to the shadow. Each zero is a point of a *critical
# curve*: there the beam is squeezed to a line, as light is on the coffee. ``index`` counts how often that has
# happened on the way to the star. It is 0 far from the shadow, and grows by one across each critical curve.

for index in range(3):
    inside = seen.index == index
    print(f"index {index}: {np.degrees(angle[inside]).max():.2f} to {np.degrees(angle[inside]).min():.2f} deg")

# %%
# The first critical curves and caustics
# --------------------------------------
#
# ``caustics`` finds the zeros in all directions, to the last digit that a computer has, and joins them.

caustics = kc.caustics(camera, orders=3)
ax = caustics.plot(sky="camera")
plt.show()

# %%
# These are the *critical curves* on the camera's sky, round the shadow: where to look. What is seen there on the
# celestial sphere are the *caustics*.

caustics.plot()
plt.show()

# %%
# The primary one is tiny, half a degree wide, on the far side of the hole: a hole that does not spin would make it a
# single point, the star exactly behind. The tertiary one winds five times round the whole sky. The number of turns, and
# the error of everything that was found:

for caustic in caustics:
    print(f"{caustic.order}: {caustic.kind}, {caustic.circuits:.4f} circuits, error {caustic.error:.0e} rad")

# %%
# Each has four tips, as the cup's line has one: *cusps*.

caustics[0].plot()
plt.show()

# %%
# The sky is folded
# -----------------
#
# Take a small grid of directions across the secondary critical curve, long in the direction in which the beam is
# squeezed (the second right singular vector of its Jacobian), short in the other one. Where does it land on the
# celestial sphere? We measure there from one point of the caustic: along it, and across it.

secondary = caustics[1]
number = len(secondary.sky) // 5
point, place, after = secondary.sky[number], secondary.celestial[number], secondary.celestial[number + 1]


def from_place(theta, phi):
    """Displacements along the caustic and across it, in milliradians, of places on the celestial sphere."""
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
    which = there.index == index
    before.scatter(1e3 * right[which], 1e3 * up[which], s=6, label=f"index {index}")
    landed.scatter(along[which], across[which], s=6)
limits = landed.get_xlim(), landed.get_ylim()
landed.plot(*from_place(*secondary.celestial.T), color="black")
landed.set(xlim=limits[0], ylim=limits[1], xlabel="along the caustic (mrad)", ylabel="across it (mrad)")
landed.set_title("where it lands")
before.set(xlabel="mrad", ylabel="mrad", title="a grid on the camera's sky")
before.legend()
plt.show()

# %%
# Like a sheet of paper the camera's sky is folded along the critical curve; the fold lies on the caustic (black). A
# star on the one side of it lies under both layers, and is seen twice. On the other side there is no paper at all.
