"""
1. The coffee cup
=================

Put a cup of coffee in the sun. On the coffee lies a bright line with a sharp tip: a *caustic*. This page draws it, and
shows why it comes with images that appear and vanish in pairs. The sky near a black hole works in the same way.
"""

# %%
# Light in a cup
# --------------
#
# Sunlight comes from the left and is thrown back by the inner wall, a circle of radius 1. A ray that meets the wall at
# the angle :math:`t` leaves it in the direction :math:`(-\cos 2t, -\sin 2t)`. Here are eighty rays.

import matplotlib.pyplot as plt
import numpy as np


def wall(t):
    """Where a ray meets the wall."""
    return np.array([np.cos(t), np.sin(t)])


def thrown_back(t):
    """The direction in which it goes on."""
    return -np.array([np.cos(2 * t), np.sin(2 * t)])


t = np.linspace(-1.5, 1.5, 80)
figure, cup = plt.subplots(figsize=(5, 5), layout="constrained")
cup.add_patch(plt.Circle((0, 0), 1, fill=False))
cup.plot(*np.stack([wall(t), wall(t) + 2 * thrown_back(t)], axis=1), color="tab:orange", linewidth=0.4)
cup.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.05), aspect="equal")
plt.show()

# %%
# No single ray is bright. The bright line is where neighbouring rays meet: they crowd along it. A thin *beam* of two
# neighbouring rays has there no width at all. Along each ray this happens once, at the distance :math:`\cos(t)/2` from
# the wall, so that the line can be drawn by itself.

caustic = wall(t) + np.cos(t) / 2 * thrown_back(t)
cup.plot(*caustic, color="black")
figure

# %%
# Seen from the coffee
# --------------------
#
# Now be a small fish in the coffee and look at the wall. You see the sun mirrored there: once for each ray that
# comes to you. A ray comes to you if your place lies on it, that is, where this function of :math:`t` is zero.


def miss(place, t):
    """How far a ray passes to the side of a place."""
    away, direction = np.asarray(place)[:, None] - wall(t), thrown_back(t)
    return away[0] * direction[1] - away[1] * direction[0]


fine = np.linspace(-1.57, 1.57, 2000)
figure, ax = plt.subplots(figsize=(6, 3), layout="constrained")
for x in (0.2, 0.5, 0.8):
    ax.plot(fine, miss((x, 0.0), fine), label=f"fish at x = {x}")
ax.axhline(0, color="black", linewidth=0.6)
ax.set(xlabel="t: where the fish looks", ylabel="miss of the ray")
ax.legend()
plt.show()

# %%
# At :math:`x = 0.2` the curve crosses zero once: one sun. At 0.8 it crosses three times: three suns. A smooth curve
# that is bent until it touches the axis and crosses it has gained *two* crossings, one on the way down and one on
# the way up; it cannot gain a single one. **That is why images come in pairs.** The two are mirror images of each
# other: one is seen where the curve goes up, one where it goes down.
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
# The number changes by two exactly on the caustic, and nowhere else.
#
# What to keep
# ------------
#
# ===================  =====================================  ==============================================
# the same thing       in the cup                             near a black hole
# ===================  =====================================  ==============================================
# what is counted      suns that a fish sees                  images of a star that the camera sees
# a ray                from a place on the wall               from a direction of the camera's sky
# where it ends        a place on the coffee                  a place on the celestial sphere, where stars are
# critical curve       where on its ray a beam has no width   where on the camera's sky a beam has no width
# **caustic**          the bright line on the coffee          what is seen there: a line on the celestial sphere
# its tip              a *cusp*; elsewhere it is a *fold*     the same words
# ===================  =====================================  ==============================================
#
# A camera near a hole sends its lines of sight out, as the wall sends rays. They bend, and land on the celestial
# sphere. A star is the fish: as many lines of sight land on it as the camera sees images of it. A star inside a
# caustic has two more images than one outside, and when it crosses the line two of them appear, or vanish, together.
