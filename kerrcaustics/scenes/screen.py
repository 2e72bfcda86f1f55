"""Screens: the part of the sky of an observer far away that becomes a picture."""

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.results.declared import quantity, result
from kerrcaustics.scenes.raster import Raster, unit_vector
from kerrcaustics.scenes.scene_checks import check_number, positive
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import numbers, quoted, real_array
from kerrcaustics.spacetime.observer import Observer, from_screen, on_screen, screen_basis

Array = np.ndarray


@result("screen/1")
class Screen(Raster):
    """A rectangle of square pixels on the sky of an `Observer`, over (alpha, beta) in units of M.

    Parameters
    ----------
    width, height : int
        Pixels; column x runs to the right from 0, row y down from 0, and whole numbers are pixel centres.
    size : float
        Full width of the picture, M.
    centre : (float, float)
        (alpha, beta) in the middle of the picture, M. If omitted, the direction to the hole.
    up : (float, float)
        The direction that points up in the picture, along (alpha, beta); of any length. If omitted, beta: the spin axis
        points up and alpha grows to the right.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    The same screen serves observers at any radius. An angle psi from the hole has the length 2 r tan(psi / 2) at a
    finite radius r, as for `Observer`; at infinity lengths are impact parameters.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> screen = kc.Screen(width=640, height=360, size=24)
    >>> screen.places(319.5, 179.5).tolist(), screen.pixel
    ([0.0, 0.0], 0.0375)
    """

    width: int = quantity("", "1", "columns of pixels")
    height: int = quantity("", "1", "rows of pixels")
    size: float = quantity("", "GM/c^2", "full width of the picture")
    centre: Any = quantity("axis", "GM/c^2", "(alpha, beta) in the middle of the picture", default=(0.0, 0.0))
    up: Any = quantity("axis", "1", "direction that points up in it, along (alpha, beta)", default=(0.0, 1.0))
    viewer: ClassVar[type[Observer]] = Observer

    def __post_init__(self) -> None:
        """Raise ValueError unless the screen is valid."""
        self._check_sides()
        size = check_number("size", self.size, "be a positive, finite number (of M)", positive)
        centre = numbers("centre", self.centre)
        if centre.shape != (2,) or not np.isfinite(centre).all():
            must = "be two finite numbers (alpha, beta)"
            raise ValueError(f"Argument `centre` must {must}, but is {quoted(self.centre)}.")
        for name, value in (("size", size), ("centre", centre), ("up", unit_vector("up", self.up, 2))):
            object.__setattr__(self, name, value)

    @property
    def pixel(self) -> float:
        """Width of a pixel, M."""
        return self.size / self.width

    @property
    def pixel_angle(self) -> float:
        """Angle between directions of neighbouring pixels in the middle of the picture, radians."""
        return self.pixel / float(self.lengths(from_screen(self.centre)))

    def places(self, x: ArrayLike, y: ArrayLike) -> Float[Array, "*batch 2"]:
        """(alpha, beta) (..., 2), M, of places of the picture, in pixels: arrays that broadcast."""
        across, down = np.broadcast_arrays(
            real_array("x", x) - (self.width - 1) / 2, real_array("y", y) - (self.height - 1) / 2
        )
        return self.centre + np.stack([across, down], axis=-1) @ self._steps.T

    def directions(self, x: ArrayLike, y: ArrayLike) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3 2"]]:
        """Directions (..., 3) of places in pixels, as engines take them, and their steps (..., 3, 2) per pixel.

        Errors: both are closed formulas, good to round-off.
        """
        sky = from_screen(self.places(x, y))
        return sky, np.stack(screen_basis(sky), axis=-1) @ self._steps

    def pixels(self, sky: ArrayLike) -> Float[Array, "*batch 2"]:
        """Places (..., 2), x and y in pixels, of (alpha, beta) (..., 2), or of directions (..., 3).

        Errors: round-off. The inverse of `places`, and of `directions`; places outside the picture are given too.
        """
        place = real_array("sky", sky)
        place = on_screen(place) if place.shape[-1] == 3 else place
        middle = np.array([(self.width - 1) / 2, (self.height - 1) / 2])
        # The steps are perpendicular, and of equal length.
        return (place - self.centre) @ self._steps / self.pixel**2 + middle

    def pixel_sizes(self, x: ArrayLike, y: ArrayLike) -> Float[Array, "*batch"]:
        """Areas (...,), M^2, of the pixels at places of the picture: all of them are equal."""
        return np.full(np.broadcast_shapes(np.shape(x), np.shape(y)), self.pixel**2)

    def lengths(self, sky: Float[Array, "*batch 3"]) -> Float[Array, "*batch"]:
        """Lengths (...,), M, of a radian beside directions."""
        return np.asarray(1 / np.linalg.norm(screen_basis(sky)[0], axis=-1))

    def moving_numbers(self, camera: Observer) -> list[float]:
        """1 / radius, 0 at infinity, inclination, size, centre, and the upward direction."""
        return [1 / camera.radius, camera.inclination, self.size, *self.centre.tolist(), *self.up.tolist()]

    def with_moving_numbers(self, spin: float, values: list[float]) -> "tuple[Observer, Screen]":
        """The observer and the screen for numbers in the order of `moving_numbers`."""
        curvature, inclination, size = values[:3]
        radius = 1 / curvature if curvature > 0 else math.inf
        observer = Observer(spin=spin, radius=radius, inclination=min(max(inclination, 0.0), math.pi))
        return observer, Screen(self.width, self.height, size, values[3:5], values[5:])

    @property
    def _steps(self) -> Float[Array, "2 2"]:
        """Changes of alpha and beta (rows) from pixel to pixel to the right and down (columns)."""
        alpha, beta = self.up
        return self.pixel * np.array([[beta, -alpha], [-alpha, -beta]])
