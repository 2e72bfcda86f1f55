"""Types of arrays in signatures. Types and shapes are checked at run time in the tests alone.

Most functions work elementwise: an argument has one number for each ray, or one for all of them.
"""

from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from kerrcaustics.shapes import Bool, Float, Real

# At run time any object with a shape: formulas are checked without JAX, which takes most of a second to load.
if TYPE_CHECKING:
    from jaxtyping import Array
else:
    Array = Any

# One number a ray, or one for all.
Reals = float | Real[Array, "*#rays"] | Real[np.ndarray, "*#rays"]
# True or false of each ray.
Flags = bool | np.bool_ | Bool[Array, "*#rays"] | Bool[np.ndarray, "*#rays"]
# A vector of each ray by its three components; vectors with these along the last axis, of either kind of array.
Components = tuple[Reals, Reals, Reals]
Vectors = TypeVar("Vectors", Float[Array, "*batch 3"], Float[np.ndarray, "*batch 3"])
# The same on the host, and one number of each.
HostVectors = Float[np.ndarray, "*batch 3"]
HostReals = Float[Any, "*batch"]
# Numbers that are broadcast with others.
HostParts = Float[Any, "*#batch"]
