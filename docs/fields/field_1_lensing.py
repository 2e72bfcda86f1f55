"""
1. Gravitational lensing: from the thin lens to the hole
========================================================

A point mass far away is the textbook lens. We find where its formulas fail: how the magnification of a star differs
from that of a thin lens as the viewer comes closer, and what spin does to the caustic.
"""

# %%
# A thin lens makes two images, of Morse index 0 and 1. For a star at angle u, in units of the Einstein radius, their
# total magnification is (u² + 2) / (u sqrt(u² + 4)). A viewer far away sees stars at infinity through a lens with the
# Einstein radius sqrt(4 / r), where r is the distance of the hole in units of its mass.

import math

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

u = 0.5
thin = (u**2 + 2) / (u * math.sqrt(u**2 + 4))
radii = np.geomspace(1e2, 1e7, 11)
off = []
for radius in radii:
    viewer = kc.Camera(spin=0.0, radius=float(radius), velocity="static")
    star = math.pi / 2, math.pi - u * math.sqrt(4 / radius)
    images = kc.star_images(viewer, star, max_index=1)
    off.append(images.magnification.sum() / thin - 1)

figure, ax = plt.subplots(figsize=(5.5, 3.2), layout="constrained")
ax.loglog(radii, -np.array(off), "o-")
ax.set(xlabel="distance of the hole (M)", ylabel="fainter than the thin lens by")
plt.show()

# %%
# The star is fainter than behind a thin lens, by about 2 / r. The camera is at rest: a moving one would see aberration
# too. (For an observer with a screen, magnifications are areas on the screen, which are proportional to solid angles
# only at large distances.)
#
# Spin turns the point into a curve
# ---------------------------------
#
# Behind a hole without spin the primary caustic is a point. With spin it is an astroid, which is tiny from far away.

caustic = kc.caustics(kc.Observer(spin=0.9, inclination=math.pi / 2, radius=1e4), orders=1)[0]
theta, phi = caustic.celestial.T
figure, ax = plt.subplots(figsize=(4, 4), layout="constrained")
scale = 1e9
ax.plot(scale * (phi - phi.mean()), scale * (theta - theta.mean()))
ax.set(xlabel="φ′ (nrad)", ylabel="θ′ (nrad)", title="spin 0.9, from 10,000 M", aspect="equal")
plt.show()

# %%
# It has four cusps, like the caustic of a symmetric lens that is slightly perturbed. For its width as a function of
# spin and distance, see :doc:`../studies`.
