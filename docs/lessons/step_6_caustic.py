"""
6. What is really seen at a caustic
===================================

On a caustic a point-like star would be infinitely bright. Two things prevent that: the star has a size, and light
has a wavelength. We move one star across a fold of the secondary caustic, and measure both effects.
"""

# %%
# The path of the star
# --------------------
#
# The star crosses the caustic at a right angle, at a fold far from all cusps. *d* is its distance from the caustic,
# positive inside, where the star has two more images.

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

camera = kc.Camera(spin=0.5, radius=16, inclination=1.2, velocity="fiducial")
caustic = kc.caustics(camera, orders=2)[1]
cusps = np.array([cusp.celestial for cusp in caustic.cusps])
nearest = np.linalg.norm(caustic.celestial[:, None] - cusps, axis=-1).min(axis=1)
at = int(np.argmax(nearest))
fold = caustic.celestial[at]
along = caustic.celestial[at + 1] - caustic.celestial[at - 1]
# Places are (θ′, φ′): a step of φ′ is shorter by sin θ′ on the sphere.
scale = np.array([1.0, np.sin(fold[0])])
across = np.array([-1.0, 1.0]) * (along * scale)[::-1] / np.linalg.norm(along * scale) / scale
across *= np.sign((cusps.mean(axis=0) - fold) @ (across * scale**2))


def place(d):
    """The place of the star at the distance d."""
    return tuple(fold + d * across)


fold

# %%
# A point, and discs
# ------------------
#
# ``magnification`` measures the images of a disc: the curves that bound them, and the area inside. Here are a point and
# discs of two sizes, with radii in radians.

distances = np.linspace(-0.01, 0.02, 30)
stars = [place(d) for d in distances]
# Index 0 is left out: it is far brighter than all others, and does not change.
point = [kc.star_images(camera, star).magnification[1:].sum() for star in stars]

figure, ax = plt.subplots(figsize=(6, 3.4), layout="constrained")
ax.plot(1e3 * distances, point, ".", label="point")
for size in (0.002, 0.005):
    light = [kc.magnification(camera, star, size).per_index for star in stars]
    ax.plot(1e3 * distances, [one[1] + one[2] for one in light], label=f"disc of {1e3 * size:.0f} mrad")
ax.set(xlabel="d (mrad)", ylabel="magnification, index 1 and 2", ylim=(0, 0.5))
ax.legend()
plt.show()

# %%
# A disc starts to brighten when its limb touches the caustic, is brightest when most of it is inside, and is as bright
# as a point once it is a few radii past the caustic. The smaller the disc, the higher the peak, which goes as one over
# the square root of its radius.
#
# Waves
# -----
#
# ``amplification`` is the field of the star's waves, divided by what the field would be without the hole. Its squared
# modulus is the brightness of a point source, and is finite. The wave of the bright image of index 0 is subtracted, to
# show the pair alone.

figure, ax = plt.subplots(figsize=(6, 3.4), layout="constrained")
way = np.linspace(-0.06, 0.12, 91)
for frequency in (20, 60):
    light = []
    for d in way:
        seen = kc.amplification(camera, place(d), frequency)
        (first,) = np.flatnonzero(seen.image_index == 0)
        bright = seen.image_amplitude[first] * np.exp(1j * frequency * seen.image_time[first])
        light.append(abs(seen.value[0] - bright) ** 2)
    ax.plot(1e3 * way, light, label=f"ωM = {frequency}")
ax.set(xlabel="d (mrad)", ylabel="brightness, index 1 and 2")
ax.legend()
plt.show()

# %%
# At d < 0 the images that are always there interfere with one another. Inside the caustic the pair joins them: its two
# waves form one hump at the caustic, beginning a little outside it, and interfere farther in. The higher the frequency,
# the narrower the fringes. For more, see :doc:`../extended_sources` and :doc:`../waves`.
