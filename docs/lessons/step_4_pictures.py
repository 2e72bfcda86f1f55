"""
4. What the camera sees: stars and a disk
=========================================

From single rays to pictures: every pixel is a narrow beam.
"""

# %%
# Stars
# -----
#
# A ``View`` sets where the camera looks and how wide its view is; ``StarField`` is the sky with the stars of the
# Hipparcos catalogue. A ``fisheye`` projection keeps angles from the middle of the picture to scale, so that much of
# the sky fits in. Stars differ in brightness by factors of thousands, which no screen can show: ``plot`` chooses an
# exposure from their light, and brightens the faint stars with the curve ``asinh``.

import matplotlib.pyplot as plt

import kerrcaustics as kc
from kerrcaustics.draw.scenes import show_critical_curves

camera = kc.Camera(spin=0.999, radius=6.03)
view = kc.pictures.View.toward_hole(camera, width=480, height=400, field_of_view=2.6, projection="fisheye")
stars = kc.render(camera, view, kc.skies.StarField())
ax = stars.plot()
show_critical_curves(ax, view, kc.caustics(camera, orders=2))
plt.show()

# %%
# Outside the primary critical curve (blue) the sky looks as usual, only bent. Between it and the secondary one
# (orange) is the whole sky once more, mirrored and squeezed, and some of it more than once, as found in the last
# lesson. Inside the secondary curve it appears again, not mirrored, and so on down to the shadow.
#
# Swatches
# --------
#
# A chessboard in place of stars shows how the sky is stretched.

board = kc.render(camera, view, kc.skies.Checkerboard())
ax = board.plot(exposure=1.0, curve="linear")
show_critical_curves(ax, view, kc.caustics(camera, orders=2))
plt.show()

# %%
# On a critical curve a beam is squeezed to a line, so that neighbouring pixels see nearly the same place on the board:
# its swatches are stretched.
#
# A disk
# ------
#
# Glowing gas circles the hole in the plane of its equator, from radius 9.26 to 18.7. We look at it from far away, just
# above that plane.

far = kc.Camera(spin=0.6, radius=74.1, inclination=1.51, velocity="static")
disk = kc.disks.Disk(inner=9.26, outer=18.70, emission=kc.disks.BlackBody(4500))
rendering = kc.render(far, kc.pictures.View(480, 200, 0.7), disk=disk)
rendering.plot()
plt.show()

# %%
# The arch over the shadow is the far part of the disk, whose light is bent over the hole; below the shadow is the
# disk's underside. Gas that comes toward us is brighter and bluer:

shifted = kc.render(far, kc.pictures.View(480, 200, 0.7), disk=disk, beaming=True, colour_shift=True)
shifted.plot()
plt.show()
