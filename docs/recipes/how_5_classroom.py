"""
Use kerrcaustics in a classroom
===============================

**Goal:** an hour in which a class sees why a black hole makes many images of one star, and predicts how many.
"""

# %%
# Before the lesson
# -----------------
#
# Write the :doc:`explorer <../explore>` as one file, ``kerrcaustics explore --page explorer.html``, and give it to the
# class: it needs no installation, and runs from a web server or a memory stick. `Here <../explorer.html>`_ it is.
#
# An hour
# -------
#
# * *0 to 10 minutes:* a cup of coffee and a torch, the bright line and its tip. `Lesson 1
#   <../tutorial/step_1_coffee_cup.html>`_ has the picture, and the same words for the cup and for the sky.
# * *10 to 25:* the explorer. Drag the star across a caustic: two images appear at one place, equally bright, and one of
#   them is mirrored. *Tour* goes through eight stars, *Quiz* asks how many images there are.
# * *25 to 45:* the worksheet below. Predict, then count.
# * *45 to 60:* play one orbit in the explorer; or `lesson 3 <../tutorial/step_3_star.html>`_ as a notebook (a link at
#   its end), in which every number can be changed.
#
# The worksheet
# -------------
#
# A picture for the board: the secondary caustic, and five places for a star. For each of them, how many images of index
# 0 and 1 does the camera see? (The terms are in the :doc:`glossary <../glossary>`. The primary caustic is tiny, and
# lies away from all five places. In the explorer: spin 0.999, radius 6.03, two orders; ⇄ turns the sphere to the side
# of this picture. Of a pair that this caustic adds, the other image has index 2.)

import math

import matplotlib.pyplot as plt

import kerrcaustics as kc

camera = kc.Camera(spin=0.999, radius=6.03)
secondary = kc.caustics(camera, orders=2)[1]
places = {"1": (60, 260), "2": (85, 260), "3": (92, 140), "4": (112, 300), "5": (125, 180)}

ax = secondary.plot()
for name, (theta, phi) in places.items():
    ax.plot(phi, theta, "*", color="black", markersize=9)
    ax.annotate(name, (phi, theta), (7, 4), textcoords="offset points", fontweight="bold", fontsize=12)
ax.set_title("How many images? Spin 0.999, r = 6.03")
plt.show()

# %%
# The answers
# -----------

for name, (theta, phi) in places.items():
    images = kc.star_images(camera, star=(math.radians(theta), math.radians(phi)), max_index=1)
    print(f"star {name}: {len(images)} images, by index {images.per_index},", "certified" * images.certified)

# %%
# What to look at
# ---------------
#
# Outside the caustic there are two images: one of index 0, which is not mirrored, and one of index 1, which is. Inside
# there is a third. It was born together with a partner of index 2, on the other side of the same critical curve: the
# number of all images changes by two, never by one. (With ``max_index=2`` the partner is counted as well, and so are
# images that belong to the tertiary caustic.) Star 4 is a good one to argue about. *Certified* means that the images
# were also counted in another way, by how often the caustics wind round the star, without looking for images.
