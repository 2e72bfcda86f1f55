"""
3. Dragging a star across a caustic
===================================

We move one star across the secondary caustic of the last lesson, and watch a pair of images being born.
"""

# %%
# All images of a star
# --------------------
#
# A star's place on the celestial sphere is (θ′, φ′): θ′ from the spin axis, φ′ round it. ``star_images`` finds every
# image of the star with an index up to ``max_index``. (There are infinitely many more, closer to the shadow, whose
# light ran round the hole more often. They get fainter and fainter, except at the moment when a pair of them is born.)

import math

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

camera = kc.Camera(spin=0.999, radius=6.03)
caustics = kc.caustics(camera, orders=3)

before = kc.star_images(camera, star=(math.radians(77), math.radians(-60)), max_index=2)
before

# %%
# ``certified`` is true. The images were found by a search; how many there must be was determined without one, from the
# caustics alone: from how often each of them runs round the star. The two numbers agree, so no image is missing.
#
# Five degrees further on
# -----------------------

after = kc.star_images(camera, star=(math.radians(77), math.radians(-65)), max_index=2)
print("before", before.per_index)
print("after ", after.per_index)

# %%
# A pair has appeared: one image of index 1, which is mirrored, and one of index 2, which is not. The circles mark these
# two images: before, there was no image near them. The secondary critical curve runs between them.

from kerrcaustics.draw.projection import about_shadow

moved = np.linalg.norm(after.sky[:, None] - before.sky, axis=-1).min(axis=1)
pair = (after.index > 0) & (moved > 0.2)

figure, panels = plt.subplots(1, 2, figsize=(8, 4.3), layout="constrained")
for ax, images in zip(panels, (before, after), strict=True):
    images.plot(ax)
    ax.set(xlim=(-70, 50), ylim=(-60, 60), title=f"star at φ′ = {math.degrees(images.star[1]):.0f} deg")
    ax.get_legend().remove()
right, above = about_shadow(camera, after.sky[pair]).T
panels[1].plot(right, above, "o", markersize=16, markerfacecolor="none", color="black")
panels[1].annotate("the pair", (right.mean() + 3, above.mean() - 8))
figure.legend(*panels[1].get_legend_handles_labels(), loc="outside lower center", ncols=4)
figure.suptitle("spin 0.999, radius 6.03, circular orbit")
plt.show()

# %%
# When exactly?
# -------------
#
# The camera circles the hole, so it sees all stars go round the other way: φ′ of a star decreases. ``pair_events``
# finds the moments when a star crosses a caustic.

events = kc.pair_events(camera, math.radians(77))
events

# %%
# The pair is born at one point of the critical curve. Put the star a little past the caustic, then closer and closer
# to it, and measure the distance between the two images: it goes as the square root of the star's distance from the
# caustic. The same holds in a coffee cup, and at every fold.

born = events[0]
for step in (1e-2, 1e-4, 1e-6):
    star = born.star[0], born.star[1] - step
    found = kc.star_images(camera, star=star, max_index=2)
    away = np.linalg.norm(found.sky - born.sky, axis=1)
    pair = found.sky[np.argsort(away)[:2]]
    print(f"star {step:.0e} rad past the caustic: images {np.linalg.norm(pair[0] - pair[1]):.2e} rad apart")

# %%
# When the star is closer to the caustic by a factor of 100, the images are closer together by a factor of 10. Both also
# grow brighter by a factor of 10, and without bound as they meet: a fish on the bright line of the cup sees two suns
# merge in a flood of light. A pair is therefore brightest when it is born, with two equally bright images. Then it
# fades: at first as one over the square root of the star's distance, then each image in its own way.
#
# One whole orbit
# ---------------
#
# ``star_tracks`` follows all images while the camera circles once.

tracks = kc.star_tracks(camera, math.radians(77), max_index=2)
tracks.plot()
plt.show()

# %%
# Each colour stands for an index. At a triangle that points up, a pair is born and its two images part; at one that
# points down, two images meet and vanish. The next figure shows the brightness over time, with the same triangles, each
# above a spike:

from kerrcaustics.draw.brightness import brightness

figure, ax = plt.subplots(figsize=(6, 3.2), layout="constrained")
brightness(ax, tracks, 0.0, tracks.period)
plt.show()

# %%
# To drag stars by hand, in a browser or a notebook, use ``kerrcaustics explore`` or ``kc.explore(spin=0.999,
# radius=6.03)``.
