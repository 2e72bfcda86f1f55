"""
1. The coffee cup
=================

Put a cup of coffee in the sun. A bright line with a sharp tip appears on the coffee: a *caustic*. This page draws it,
and shows why it comes with images that appear and vanish in pairs. The sky near a black hole works in the same way.
"""

# %%
# Light in a cup
# --------------
#
# Sunlight comes from the left and is reflected by the inner wall, a circle of radius 1. A ray that meets the wall at
# the angle :math:`t` leaves it in the direction :math:`(-\cos 2t, -\sin 2t)`. Here are eighty rays.

import matplotlib.pyplot as plt
import numpy as np


def wall(t):
    """The place at which a ray meets the wall."""
    return np.array([np.cos(t), np.sin(t)])


def thrown_back(t):
    """The direction of the reflected ray."""
    return -np.array([np.cos(2 * t), np.sin(2 * t)])


t = np.linspace(-1.5, 1.5, 80)
figure, cup = plt.subplots(figsize=(5, 5), layout="constrained")
cup.add_patch(plt.Circle((0, 0), 1, fill=False))
cup.plot(*np.stack([wall(t), wall(t) + 2 * thrown_back(t)], axis=1), color="tab:orange", linewidth=0.4)
cup.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.05), aspect="equal")
plt.show()

# %%
# No single ray is bright. The bright line is where neighbouring rays meet: they crowd along it. Think of two
# neighbouring rays as the sides of a thin *beam*. Where they meet, the beam has no width at all, and beyond that point
# its sides are swapped. **A caustic is the line of all points at which thin beams have no width.** In the cup that
# happens once along each ray, at a distance of :math:`\cos(t)/2` from the wall, so the line can be drawn directly,
# without the rays.

caustic = wall(t) + np.cos(t) / 2 * thrown_back(t)
cup.plot(*caustic, color="black")
figure

# %%
# Seen from the coffee
# --------------------
#
# Now imagine that you are a small fish in the coffee, looking at the wall. You see the sun reflected there, once for
# each ray that reaches you. A ray reaches you if it passes through the place where you are, that is, if this function
# of :math:`t` is zero.


def miss(place, t):
    """The distance by which a ray misses a place."""
    away, direction = np.asarray(place)[:, None] - wall(t), thrown_back(t)
    return away[0] * direction[1] - away[1] * direction[0]


fine = np.linspace(-1.57, 1.57, 2000)
figure, ax = plt.subplots(figsize=(6, 3), layout="constrained")
for x in (0.2, 0.5, 0.8):
    ax.plot(fine, miss((x, 0.0), fine), label=f"fish at x = {x}")
ax.axhline(0, color="black", linewidth=0.6)
ax.set(xlabel="t: where the fish looks", ylabel="by how far the ray misses")
ax.legend()
plt.show()

# %%
# At :math:`x = 0.2` the curve crosses zero once: one sun. At 0.8 it crosses three times: three suns. As the fish
# swims, its curve bends. A smooth curve that is bent until it touches the axis and crosses it has gained *two*
# crossings, one on the way down and one on the way up; it cannot gain just one. **That is why images come in
# pairs.**
#
# Two more things can be read from the curve. Where it goes up, a ray a little further on passes the fish on one side;
# where it goes down, on the other: left and right are swapped. So *one of the two images is mirrored*. And where the
# curve just touches the axis it is flat: a whole bundle of rays passes close to the fish, which sees a lot of light. So
# *both images are brightest at their birth*; then they part and fade, as the curve crosses the
# axis ever more steeply.
#
# Let us count the suns everywhere in the cup.

across = np.linspace(-1, 1, 121)
suns = np.full((121, 121), np.nan)
for i, y in enumerate(across):
    for j, x in enumerate(across):
        if x * x + y * y < 1:
            suns[i, j] = np.sum(np.diff(np.sign(miss((x, y), fine))) != 0)

figure, ax = plt.subplots(figsize=(5.5, 4.5), layout="constrained")
shown = ax.pcolormesh(across, across, suns, cmap="YlOrBr", vmin=0, vmax=4)
figure.colorbar(shown, label="suns that a fish sees there")
ax.plot(*caustic, color="black")
ax.set_aspect("equal")
plt.show()

# %%
# The number changes by two exactly on the caustic, and nowhere else: it is three between the two arms of the line, one
# outside.
#
# What to remember
# ----------------
#
# ===================  =====================================  ==============================================
# the same thing       in the cup                             near a black hole
# ===================  =====================================  ==============================================
# what is counted      suns that a fish sees                  images of a star that the camera sees
# a ray                from a place on the wall, :math:`t`    from a direction of the camera's sky
# where it ends        a place on the coffee                  a place on the celestial sphere, where stars are
# *critical curve*     which rays, and how far along them     which directions: a curve on the camera's sky
# *caustic*            where these rays meet: a bright line   where their rays land: a curve on the celestial sphere
# *cusp*, *fold*       its tip; the rest of it                the same
# ===================  =====================================  ==============================================
#
# Near a hole light is followed backward, from the camera, which swaps the roles: lines of sight are the rays, the
# celestial sphere is the coffee on which they land, and a star is the fish. The camera sees one image of the star for
# each line of sight that lands on it. On one side of a caustic a star has two more images than on the other, and when
# it crosses the line these two appear, or vanish, together.
