"""Rasters: rectangles of pixels on the sky of a viewer, of a `Camera` or of an `Observer`."""

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import numbers, quoted, whole_number
from kerrcaustics.spacetime.observer import Observer
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

MOST_PIXELS = 16384
"""The largest number of pixels along a side of a picture."""
_WORDS = {2: "two", 3: "three"}


class Raster(Shown):
    """A rectangle of pixels on a viewer's sky; whole numbers are pixel centres, from the upper left pixel.

    Directions are unit vectors as the engines take them: the sky of a camera itself, and the sphere that an observer's
    screen becomes. viewer: the class of its viewers.
    """

    width: int
    height: int
    viewer: ClassVar[Any]

    @property
    def form(self) -> tuple[Any, ...]:
        """Properties that are constant during an exposure."""
        return type(self), self.width, self.height

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.height, self.width

    @property
    def closed(self) -> bool:
        """True if some places beyond a side of the picture lie in it too."""
        return False

    @property
    def even(self) -> bool:
        """True if neighbouring pixels are of about one size everywhere."""
        return True

    @property
    def pixel_angle(self) -> float:
        """Angle between directions of neighbouring pixels in the middle of the picture, radians."""
        raise NotImplementedError

    def directions(self, x: ArrayLike, y: ArrayLike) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3 2"]]:
        """Directions (..., 3) of places in pixels, and their steps (..., 3, 2) per pixel along x and y."""
        raise NotImplementedError

    def places(self, x: ArrayLike, y: ArrayLike) -> Float[Array, "*batch axes"]:
        """Places on the viewer's own sky, in its coordinates, of places in pixels."""
        return self.directions(x, y)[0]

    def pixels(self, sky: ArrayLike) -> Float[Array, "*batch 2"]:
        """Places (..., 2) in pixels of directions (..., 3), or of places on the viewer's own sky."""
        raise NotImplementedError

    def pixel_sizes(self, x: ArrayLike, y: ArrayLike) -> Float[Array, "*batch"]:
        """Sizes (...,) of pixels at places of the picture, in the square of the viewer's unit."""
        raise NotImplementedError

    def lengths(self, sky: Float[Array, "*batch 3"]) -> Float[Array, "*batch"]:
        """Lengths (...,) on the viewer's own sky, in its unit, of a radian beside directions."""
        return np.ones(sky.shape[:-1])

    def solid_angle(self, steps: Float[Array, "*batch 3 2"]) -> Float[Array, "*batch"]:
        """Solid angle (...,), steradian, of pixels with these steps (..., 3, 2)."""
        return np.asarray(np.linalg.norm(np.cross(steps[..., 0], steps[..., 1]), axis=-1))

    def moving_numbers(self, camera: Any) -> list[float]:
        """Numbers of a viewer and of this part of its sky that can be interpolated in time."""
        raise NotImplementedError

    def with_moving_numbers(self, spin: float, values: list[float]) -> "tuple[Viewer, Raster]":
        """The viewer and the part of its sky for numbers in the order of `moving_numbers`."""
        raise NotImplementedError

    def _check_sides(self) -> None:
        """Raise ValueError unless width and height are valid."""
        for name in ("width", "height"):
            object.__setattr__(self, name, whole_number(name, getattr(self, name), 1, MOST_PIXELS))


def check_picture(camera: object, view: object) -> None:
    """Raise ValueError unless the viewer is valid, and the raster lies on its sky."""
    check_viewer(camera)
    name = type(view).__name__
    if not isinstance(view, Raster):
        raise ValueError(f"Argument `view` must be a View or a Screen, but is {name}.")
    if not isinstance(camera, view.viewer):
        right = "Screen" if isinstance(camera, Observer) else "View"
        raise ValueError(f"Argument `view` must be a {right} for {_article(camera)}, but is a {name}.")


def _article(viewer: object) -> str:
    name = type(viewer).__name__
    return f"an {name}" if name[0] in "AEIO" else f"a {name}"


def unit_vector(name: str, vector: Any, size: int) -> Float[Array, " size"]:
    """The argument `name` as a unit vector of `size` components; ValueError if it has no direction."""
    value = numbers(name, vector)
    if value.shape != (size,) or not np.isfinite(value).all() or not value.any():
        must = f"be a vector of {_WORDS[size]} numbers that is not zero"
        raise ValueError(f"Argument `{name}` must {must}, but is {quoted(vector)}.")
    return value / np.linalg.norm(value)
