"""
6. X-ray lines: what each image adds to a profile
=================================================

An iron line from a thin disk, as a spectrograph sees it, with the share of light that goes round the hole.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

observer = kc.Observer(spin=0.9, inclination=math.radians(60))
figure, ax = plt.subplots(figsize=(6, 3.4), layout="constrained")
bins = np.linspace(0.05, 1.35, 131)
for crossing in (1, 2):
    line = kc.line_profile(observer, inner=2.3209, outer=30, emissivity=3, crossing=crossing, bins=bins)
    ax.stairs(line.flux, line.edges, label=f"crossing {crossing}")
    print(f"crossing {crossing}: {line.flux.sum():.3f}, largest error of a bin {line.error.max():.1e}")
ax.set(xlabel="frequency / emitted frequency", ylabel="light (M²)", yscale="log", ylim=(1e-5, None))
ax.legend()
plt.show()

# %%
# The disk reaches in to the innermost stable orbit; spins are measured from the red wing. The second crossing is
# light from the lower face, bent round the hole: it is seen where nothing is in the way, such as inside the inner rim.
#
# `emissivity` is either the exponent of the power law by which the line's emission falls with radius, or a function of
# the radius. For checks against another program, see :doc:`../disk_studies`.
