"""
3. Flares near Sgr A*: a spot on an orbit
=========================================

A bright spot circles the hole at 9 M, like the flares seen at infrared wavelengths. We compute what an interferometer
measures: flux and centroid over time, in minutes and microarcseconds.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

observer = kc.Observer(spin=0.9, inclination=math.radians(25))
scale = kc.PhysicalScale(4.3e6, 8180)  # solar masses, parsecs
times = np.linspace(0, 2 * math.pi * (9**1.5 + 0.9), 120)
light = kc.light_curve(observer, 9.0, times, source="point", max_index=2)
light

# %%
# One unit of time is 21 seconds; one unit of length on the sky is 5.2 microarcseconds.

minutes = scale.seconds * times / 60
size = scale.microarcseconds
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained")
left.plot(minutes, light.flux / light.flux.mean())
left.set(xlabel="time (minutes)", ylabel="flux / mean flux")
right.plot(*(size * light.centroid.T))
right.plot(0, 0, "k+", markersize=10)
right.set(xlabel="α (μas)", ylabel="β (μas)", aspect="equal", title="centroid")
plt.show()

# %%
# The peak is due to beaming, as the spot comes toward us; the cross marks the hole. The path is not centred on it, as
# the two sides of the orbit are lensed differently. Each image contributes its share of the light:

share = light.shares.sum(axis=1) / light.shares.sum()
print("share of each image in all light:", np.round(share, 4))
print(f"largest error of the flux, by the mean: {(light.error / light.flux.mean()).max():.1e}")

# %%
# For a ball instead of a point, orbits that leave the equatorial plane, and FITS tables, see :doc:`../moving_sources`.
