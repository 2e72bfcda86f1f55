"""Views: the part of the camera sky that becomes a picture, and the parts of its pixels."""

import math
from typing import Any, ClassVar, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.results.declared import quantity, result
from kerrcaustics.scenes.raster import Raster, unit_vector
from kerrcaustics.scenes.scene_checks import check_number, positive
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.camera import Camera, check_camera
from kerrcaustics.spacetime.checks import if_degrees, one_of, real_array
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge

Array = np.ndarray

Projection = Literal["pinhole", "fisheye", "equirectangular"]
PROJECTIONS: tuple[Projection, ...] = get_args(Projection)

_EDGE_POINTS = 720
_WIDEST_PINHOLE = math.radians(170)


@result("view/1")
class View(Raster):
    """A rectangle of pixels on the camera sky.

    Parameters
    ----------
    width, height : int
        Pixels; column x runs to the right from 0, row y down from 0, and whole numbers are pixel centres.
    field_of_view : float
        Full horizontal angle of the picture, radians.
    projection : str
        "pinhole" (straight lines stay straight; at most 170 degrees), "fisheye" (azimuthal equidistant: angles from the
        centre are true), "equirectangular" (longitude and latitude about `up`; half as many rows as columns for a
        whole sky).
    forward, up : (3,) arrays
        Unit vectors N in the camera basis: the direction in the middle of the picture, and the upward one; `up` may
        be any vector that is not along `forward`. If omitted, -e_x and e_z: toward the hole, the spin axis up, for a
        camera that is at rest or moves along e_phi; `toward_hole` looks at the middle of the shadow.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    Right is forward x up.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> view = kc.pictures.View(width=640, height=360, field_of_view=1.2)
    >>> sky, steps = view.directions(319.5, 179.5)
    >>> sky.round(12).tolist()
    [-1.0, 0.0, 0.0]
    """

    width: int = quantity("", "1", "columns of pixels")
    height: int = quantity("", "1", "rows of pixels")
    field_of_view: float = quantity("", "rad", "full horizontal angle", given=True)
    projection: str = quantity("", "", "projection of the sky onto the flat picture", default="pinhole")
    forward: Any = quantity("axis", "1", "direction N in the middle of the picture", default=(-1.0, 0.0, 0.0))
    up: Any = quantity("axis", "1", "direction N that points up in it", default=(0.0, 0.0, 1.0))
    viewer: ClassVar[Any] = Camera

    def __post_init__(self) -> None:
        """Raise ValueError unless the view is valid; make the axes orthonormal."""
        self._check_sides()
        one_of("projection", self.projection, PROJECTIONS)
        _check_field(self.field_of_view, self.width, self.height, self.projection)
        object.__setattr__(self, "field_of_view", float(self.field_of_view))
        forward = unit_vector("forward", self.forward, 3)
        up = unit_vector("up", self.up, 3)
        up = up - (up @ forward) * forward
        if np.linalg.norm(up) < 1e-9:
            raise ValueError("Argument `up` must not lie along `forward`.")
        object.__setattr__(self, "forward", forward)
        object.__setattr__(self, "up", up / np.linalg.norm(up))

    @classmethod
    def toward_hole(
        cls, camera: Camera, width: int, height: int, field_of_view: float, projection: str = "pinhole"
    ) -> "View":
        """The view with the middle of the shadow in its centre and the spin axis (-e_theta) up."""
        check_camera(camera)
        forward, _, up = shadow_axes(camera, shadow_edge(camera, _EDGE_POINTS))
        return cls(width, height, field_of_view, projection, forward, up)

    @property
    def right(self) -> Float[Array, "3"]:
        """Unit vector (3,) to the right."""
        return np.cross(self.forward, self.up)

    @property
    def pixel(self) -> float:
        """Step from one pixel to the next in the middle of the picture: radians, for a pinhole their tangent."""
        if self.projection == "pinhole":
            return 2 * math.tan(self.field_of_view / 2) / self.width
        return self.field_of_view / self.width

    @property
    def form(self) -> tuple[Any, ...]:
        """Properties that are constant during an exposure."""
        return *super().form, self.projection

    @property
    def even(self) -> bool:
        """True if neighbouring pixels have similar sizes everywhere, which fails at poles."""
        return self.projection == "pinhole"

    @property
    def pixel_angle(self) -> float:
        """Angle between directions of neighbouring pixels in the middle of the picture, radians."""
        return self.pixel

    def directions(self, x: ArrayLike, y: ArrayLike) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3 2"]]:
        """Directions N (..., 3) of points of the picture, and their steps (..., 3, 2) per pixel along x and y.

        Parameters: x, y, arrays that broadcast, in pixels; whole numbers are pixel centres.
        Errors: both are closed formulas, good to round-off.
        """
        axes, middle = (self.forward, self.right, self.up), ((self.width - 1) / 2, (self.height - 1) / 2)
        pixels = [*map(tuple, axes)], self.pixel, middle
        return kernel(f"view_{self.projection}")(pixels, real_array("x", x), real_array("y", y))

    @property
    def closed(self) -> bool:
        """True if some places beyond a side of the picture lie in it too: it goes round the sky, or to a pole."""
        reach = self.field_of_view * max(1.0, 2 * self.height / self.width)
        return self.projection == "equirectangular" and reach > 2 * math.pi * (1 - 1e-9)

    def pixel_sizes(self, x: ArrayLike, y: ArrayLike) -> Float[Array, "*batch"]:
        """Solid angles (...,), steradian, of the pixels at places of the picture: as of their steps, in closed form."""
        across, above = (real_array("x", x) - (self.width - 1) / 2), (self.height - 1) / 2 - real_array("y", y)
        across, above = across * self.pixel, above * self.pixel
        if self.projection == "pinhole":
            return np.asarray(self.pixel**2 * (1 + across**2 + above**2) ** -1.5)
        if self.projection == "fisheye":
            return np.asarray(self.pixel**2 * np.abs(np.sinc(np.hypot(across, above) / np.pi)))
        return np.asarray(self.pixel**2 * np.abs(np.cos(above)) * np.ones_like(across))

    def pixels(self, sky: ArrayLike) -> Float[Array, "*batch 2"]:
        """Places (..., 2), x and y in pixels, of directions N (..., 3); NaN for directions behind a pinhole.

        Errors: round-off. The inverse of `directions`; places outside the picture are given too.
        """
        n = real_array("sky", sky) @ np.stack([self.forward, self.right, self.up]).T
        along, right, up = np.moveaxis(n, -1, 0)
        if self.projection == "pinhole":
            with np.errstate(divide="ignore", invalid="ignore"):
                across, above = (np.where(along > 0, part / along, np.nan) for part in (right, up))
        elif self.projection == "fisheye":
            # Nothing overflows; this is much faster than `hypot`.
            beside = np.sqrt(right * right + up * up)
            scale = np.where(beside > 0, np.arctan2(beside, along) / np.maximum(beside, 1e-300), 1.0)
            across, above = right * scale, up * scale
        else:
            across, above = np.arctan2(right, along), np.arctan2(up, np.hypot(along, right))
        return np.stack(
            [across / self.pixel + (self.width - 1) / 2, (self.height - 1) / 2 - above / self.pixel], axis=-1
        )

    def moving_numbers(self, camera: Camera) -> list[float]:
        """Place, velocity, field of view, and axes in the frame of the fiducial observer."""
        axes = np.stack([self.forward, self.up]) @ np.asarray(camera.frame().basis)
        return [
            camera.radius,
            camera.inclination,
            *camera.fido_velocity(),
            self.field_of_view,
            *axes.ravel().tolist(),
        ]

    def with_moving_numbers(self, spin: float, values: list[float]) -> "tuple[Camera, View]":
        """The camera and the view for numbers in the order of `moving_numbers`."""
        radius, inclination, *velocity = values[:5]
        camera = Camera(spin, radius, min(max(inclination, 0.0), math.pi), (velocity[0], velocity[1], velocity[2]))
        forward, up = np.reshape(values[6:], (2, 3)) @ np.asarray(camera.frame().basis).T
        return camera, View(self.width, self.height, values[5], self.projection, forward, up)


def widest_field(projection: str, width: int, height: int) -> float:
    """The largest horizontal field, radians, that a picture of some shape can have in a projection.

    A pinhole wider than that is nearly all stretched rim, an equirectangular picture goes once round the sky and from
    pole to pole, and a fisheye's corners lie opposite to its centre.
    """
    if projection == "pinhole":
        return _WIDEST_PINHOLE
    if projection == "equirectangular":
        return min(2 * math.pi, math.pi * width / height)
    return 2 * math.pi / math.hypot(1, height / width)


def _check_field(angle: float, width: int, height: int, projection: str) -> None:
    check_number("field_of_view", angle, "be a positive, finite number of radians", positive)
    widest = widest_field(projection, width, height)
    if angle > widest * (1 + 1e-12):
        shape = f"a {projection} picture of {width} x {height} pixels"
        limit = f"{widest:.6g} radians ({math.degrees(widest):.6g} degrees)"
        raise ValueError(
            f"Argument `field_of_view` must be at most {limit} for {shape}, but is {angle:g}{if_degrees(angle, widest)}"
        )
