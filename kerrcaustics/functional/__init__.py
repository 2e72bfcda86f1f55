"""Rays, images of stars, pair events and the light of discs as pure functions for JAX: jit, vmap, grad.

Unlike the engines behind `trace_rays`, which are compiled once for all callers and estimate errors, these are traced by
the caller's own transformations.

Derivatives of any order, forward and reverse, are taken by forward differentiation inside: a loop of unknown length
allows no other, and the arguments are six numbers.

All arithmetic is in float64, whatever the settings of JAX. JAX itself still converts arguments and
gradients: without `jax_enable_x64`, `jit`, `vmap` and `grad` round Python's floats and NumPy's arrays to float32,
and gradients come back in the type of the arguments.
"""

from kerrcaustics.functional.disc_images import magnification
from kerrcaustics.functional.fold_events import event_time
from kerrcaustics.functional.image_roots import Images, images
from kerrcaustics.functional.rays import direction, travel_time
from kerrcaustics.functional.starting_points import StartingPoints, starting_points

__all__ = [
    "Images",
    "StartingPoints",
    "direction",
    "event_time",
    "images",
    "magnification",
    "starting_points",
    "travel_time",
]
