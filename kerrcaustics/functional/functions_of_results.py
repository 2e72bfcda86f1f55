"""Results as functions that JAX traces."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from kerrcaustics.functional.image_roots import Images, images
from kerrcaustics.images.images import StarImages
from kerrcaustics.spacetime.camera import Camera


def function_of(result: StarImages) -> Callable[..., Images]:
    """A result as a function of spin, radius, inclination and star; described by `StarImages.function`."""
    camera, surface = result.camera, result.surface
    if not isinstance(camera, Camera) or surface.finite:
        raise ValueError(
            "The images must be those of a star on the celestial sphere, as a Camera sees it; for others there is "
            "`image_derivatives`."
        )
    velocity = camera.velocity
    assert velocity is not None
    given = {name: getattr(camera, name) for name in ("spin", "radius", "inclination")} | {"star": result.star}

    def images_at(spin: Any = None, radius: Any = None, inclination: Any = None, star: Any = None) -> Images:
        """The images of the result at other parameters; those left out are the result's."""
        changed = {"spin": spin, "radius": radius, "inclination": inclination, "star": star}
        place = given | {name: value for name, value in changed.items() if value is not None}
        seen = images(**place, near=result.sky, index=result.index, velocity=velocity)
        # Float64 that JAX does not expect makes it warn at each operation.
        width = jnp.result_type(float)
        return Images(*(jax.lax.convert_element_type(part, width) for part in seen))

    return images_at
