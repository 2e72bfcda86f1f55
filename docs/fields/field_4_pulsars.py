"""
4. Pulsars and stars: arrival times for each image
==================================================

A pulsar passes behind a massive hole. Its pulses reach us along two paths: we find both travel
times, and how bright the second image is.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

observer = kc.Observer(spin=0.9, inclination=math.pi / 2)
orbit = kc.Orbit.kepler(500.0, 0.1, inclination=math.radians(88))
times = np.linspace(0.0, 2 * math.pi * 500**1.5, 200)
light = kc.light_curve(observer, orbit, times, max_index=1)
delay = light.travel_time

figure, (upper, lower) = plt.subplots(2, 1, figsize=(6.5, 5), sharex=True, layout="constrained")
upper.plot(light.time / 1e4, delay.T)
upper.set_ylabel("delay (M)")
lower.semilogy(light.time / 1e4, light.shares.T)
lower.set(xlabel="arrival time (10,000 M)", ylabel="flux of each image")
figure.suptitle("Images of index 0 and 1, seen edge-on")
plt.show()

# %%
# Most of the delay is due to the size of the orbit (the Roemer delay). The rest is the Shapiro delay, here in full and
# not only to first order: when the pulsar is behind the hole both images have nearly the same delay, and both are
# bright.
#
# The mass of the hole converts these delays to seconds: for Sgr A* one M is 21 s. Errors are in
# ``light.emission_time_error``.
#
# Arrival times of single pulses, and events at which pairs of images are born, are in :doc:`../moving_sources`.
