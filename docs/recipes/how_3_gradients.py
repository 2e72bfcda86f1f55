"""
Take gradients
==============

**Goal:** to find how the view changes with spin, place and source, and to fit these to observations. There are two
ways: derivatives of results, which come as numbers with errors, and functions for ``jax.grad``, ``jax.jit`` and
``jax.vmap``.
"""

# %%
# Derivatives of results
# ----------------------
#
# ``image_derivatives`` takes the images of a star, and returns how the place, the magnification and the travel time of
# each change with each parameter. (For caustics and for pair events there are ``caustic_derivatives`` and
# ``event_derivatives``.)

import matplotlib.pyplot as plt
import numpy as np

import kerrcaustics as kc

camera = kc.Camera(spin=0.9, radius=10.0, inclination=1.0, velocity="fiducial")
images = kc.star_images(camera, star=(1.4, 2.9), max_index=1)
change = kc.image_derivatives(camera, images)
by_spin = change.parameters.index("spin")
for number in range(len(images)):
    print(f"image of index {images.index[number]}: d ln |magnification| / d spin =", end=" ")
    print(f"{change.magnification[number, by_spin] / images.magnification[number]:.6f}")

# %%
# Functions for jit, vmap and grad
# --------------------------------
#
# ``kc.functional.direction`` is one line of sight as a pure function: it takes spin, radius, inclination and a
# direction on the camera's sky, and returns the place on the celestial sphere. ``jit`` compiles it, ``vmap`` maps it
# over arrays, ``grad`` and ``jacfwd`` differentiate it; they can be combined and repeated. ``jax_enable_x64`` keeps JAX
# from rounding arguments to seven digits.
#
# Here are twelve lines of sight of a camera at r = 10, with the places on the celestial sphere from which their light
# was seen to come. Which spin and inclination fit them? Newton's method finds out in a few steps.

import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)
angle = jnp.linspace(0.0, 2 * jnp.pi, 12, endpoint=False)
sky = jnp.stack([jnp.full(12, -0.8), 0.6 * jnp.cos(angle), 0.6 * jnp.sin(angle)], axis=-1)
seen = kc.functional.direction(0.9, 10.0, 1.0, sky)


@jax.jit
def miss(parameters):
    """Differences of the places for a spin and an inclination, and their gradient."""

    def differences(parameters):
        return (kc.functional.direction(parameters[0], 10.0, parameters[1], sky) - seen).ravel()

    return differences(parameters), jax.jacfwd(differences)(parameters)


guess = jnp.array([0.7, 0.9])
steps = []
for _ in range(8):
    differences, gradient = miss(guess)
    steps.append([float(jnp.abs(differences).max()), abs(float(guess[0]) - 0.9)])
    guess = guess - jnp.linalg.lstsq(gradient, differences)[0]
print("spin, inclination:", guess)

figure, ax = plt.subplots(figsize=(5.5, 3.2), layout="constrained")
ax.semilogy(np.maximum(steps, 1e-17), "o-", label=["largest difference (rad)", "error of the spin"])
ax.set(xlabel="step", title="A fit of spin and inclination, spin 0.9, r = 10")
ax.legend()
plt.show()

# %%
# What to look at
# ---------------
#
# At the end the number of correct digits doubles from step to step, down to round-off: this happens only with correct
# gradients. With finite differences in place of the gradient, the improvement would stop halfway.
#
# ``direction`` follows one line of sight to the celestial sphere; if the line is captured, the result is ``nan``, and
# so is its gradient. Searches for images and caustics are not differentiated. ``kc.functional.images`` follows images
# already found; ``images.function()`` is the same for a result of ``star_images``, which fills in what is left out:
# ``jax.grad(lambda spin: images.function()(spin=spin).magnification[0])(0.9)``. ``event_time`` is the time at which a
# star meets a caustic, and ``magnification`` is the light of a disc, even while it crosses a caustic. For more, see the
# `Python reference <../api.html#derivatives>`_.
