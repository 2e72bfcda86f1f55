"""
5. Gravitational waves near a massive hole: amplification
=========================================================

A binary near a massive hole sends its chirp past the hole. We compute the amplification as a function of frequency, and
see when images alone are enough.
"""

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

viewer = kc.Observer(spin=0.9, inclination=1.3)
frequencies = np.geomspace(0.1, 30, 400)  # angular, times the mass of the hole
waves = kc.amplification(viewer, (1.4, 2.9), frequencies, end=30.0, max_index=2)
images = kc.amplification(viewer, (1.4, 2.9), frequencies, end=30.0, max_index=2, method="images")
for index, amplitude, time in zip(waves.image_index, waves.image_amplitude, waves.image_time, strict=True):
    print(f"n = {index}: g sqrt(mu) = {amplitude:.4f}, T = {time:.3f} M")

# %%
# The source is 30 M behind the hole, the viewer at infinity. The images of index 0 and 1 interfere; where their phases
# are close, at low frequencies, their sum is wrong, and the integral over the ring that they form is used instead.

figure, ax = plt.subplots(figsize=(6, 3.4), layout="constrained")
size = np.abs(waves.value)
ax.fill_between(frequencies, size - waves.error, size + waves.error, alpha=0.3)
ax.semilogx(frequencies, size, label="amplification, with its error")
ax.semilogx(frequencies, np.abs(images.value), "--", linewidth=0.8, label="sum of images")
ax.set(xlabel="ω M", ylabel="|F|")
ax.legend()
plt.show()

# %%
# For a hole of a million suns ωM = 1 is 32 mHz. The images of index 2 and higher are the echoes, which arrive one turn
# later. The three columns printed above are what codes for lensed waves take as input: see :doc:`../waves`.

print("method at the lowest and the highest frequency:", waves.method[0], waves.method[-1])
