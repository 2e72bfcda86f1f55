"""
2. Interferometry: rings of one source
======================================

An array resolves the images of one patch of the disk that are made by rays crossing the equatorial plane once, twice
and three times. We find the delay and the demagnification from each image to the next, for a hole like that of M87.
"""

# %%
# The place of a source in the equatorial plane is (r, φ), and `EquatorialPlane(n)` selects the rays that cross the
# plane at the source for the n-th time.

import math
from itertools import pairwise

import matplotlib.pyplot as plt

import kerrcaustics as kc

observer = kc.Observer(spin=0.94, inclination=math.radians(17))
place = 6.0, 1.0
rings = [kc.star_images(observer, place, max_index=6, end=kc.EquatorialPlane(n)) for n in (1, 2, 3)]
for n, seen in enumerate(rings, 1):
    print(f"crossing {n}: {seen.magnification.sum():.3e}, arrives at {seen.time.min():.2f} M")

# %%
# From one crossing to the next the magnification changes by a factor that tends to exp(-γ), where γ is the Lyapunov
# exponent of photon orbits, and the delay tends to the time of half a turn on these orbits, about 16 M. The first
# crossings are still far from both limits.

for first, second in pairwise(rings):
    share = second.magnification.sum() / first.magnification.sum()
    print(f"area less by {share:.4f}, later by {second.time.min() - first.time.min():.2f} M")

# %%
# These magnifications are areas on the screen. The light of a patch of the disk, over all frequencies, is also
# proportional to the fourth power of the frequency ratio; the gas moves on circular orbits, which is the default of
# `EquatorialPlane`. (An orbiting spot moves between the emission of the light of one image and that of the next: a
# light curve takes this into account.)

light = [(seen.magnification * seen.redshift**4).sum() for seen in rings]
for first, second in pairwise(light):
    print(f"fainter by {second / first:.4f}")

# %%
# The positions of the images on the screen, with the edge of the shadow, and the delay in hours for a mass of 6.5e9
# suns:

figure, ax = plt.subplots(figsize=(4.5, 4.5), layout="constrained")
edge = kc.shadow_edge(observer, 400)
ax.plot(*edge.T, color="black", linewidth=0.8)
for n, seen in enumerate(rings, 1):
    ax.plot(*seen.sky.T, "o", label=f"crossing {n}")
ax.set(xlabel="α (M)", ylabel="β (M)", aspect="equal", xlim=(-8, 8), ylim=(-8, 8))
ax.legend()
plt.show()
hour = kc.PhysicalScale(6.5e9, 16.8e6).seconds / 3600
later = hour * (rings[1].time.min() - rings[0].time.min())
print(f"one M is {hour:.2f} hours: the second crossing arrives {later:.0f} hours after the first")

# %%
# For more on sources in the equatorial plane, see :doc:`../disks` and :doc:`../disk_studies`.

# %%
# All images of one order lie in one band, between the images of the two edges of the disk. `photon_rings` finds these
# bands without a picture, with the exponents by which one follows from the other along the shadow edge:

bands = kc.photon_rings(observer, inner="isco", outer=20.0)
shrink = bands.edge.lyapunov
print(f"exp(-γ) from {math.exp(-shrink.max()):.4f} to {math.exp(-shrink.min()):.4f}")
for first, second in pairwise(bands):
    print(f"area of n = {second.order} over that of n = {first.order}: {second.solid_angle / first.solid_angle:.4f}")

# %%
# On long baselines the thinnest ring that is not yet resolved dominates. Each band alone, uniformly bright, in units of
# its own flux:

scale = kc.PhysicalScale(6.5e9, 16.8e6)
baseline = [0.5 * i for i in range(1, 601)]
seen = kc.ring_visibility(bands, baseline, 0.0, scale=scale)
figure, ax = plt.subplots(figsize=(6, 3.5), layout="constrained")
for n, flux, value in zip(seen.order, seen.flux, seen.value, strict=True):
    if n:
        ax.plot(seen.u, abs(value) / flux, label=f"n = {n}", linewidth=0.8)
ax.set(xlabel="baseline (giga-wavelengths)", ylabel="visibility over flux", yscale="log", ylim=(1e-4, 1))
ax.legend()
plt.show()
