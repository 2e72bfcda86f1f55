"""Distant observers, and their screens: a sky in units of the mass."""

import math
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.spacetime.checks import real_array, real_number
from kerrcaustics.spacetime.frame import Frame
from kerrcaustics.spacetime.sphere import tangent_basis
from kerrcaustics.spacetime.viewer import LARGEST_RADIUS, Viewer, check_place, finite_number, frame_at

# In double precision the limit: 1 / radius is nothing beside 1, and its twelfth power is still a number.
_INFINITE = 1e20
SCREEN = 10.0
"""Radius of a camera for which the hole is as large as on the sphere that the screen becomes."""
# The limit of the search for critical curves: in sqrt(radius), of which the primary has two, and in M.
_BEYOND_PRIMARY, _FARTHEST = 20.0, 1e7


@result("observer/1", record="viewer=observer spin radius inclination velocity", eq=True)
class Observer(Viewer):
    """A fiducial observer far away, who measures directions by the impact parameters of a plane wave.

    Parameters
    ----------
    spin : float
        Spin a of the hole, 0 <= a < 1, along +z (units of the mass).
    inclination : float
        Polar angle of the observer in radians, 0 to pi.
    radius : float, optional
        Boyer-Lindquist radius, at most 1e9, or infinite.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    The sky has two coordinates (alpha, beta) in units of M, from the direction to the hole: alpha increases toward
    e_phi, to the right if the spin axis points up, and beta toward the axis. At infinity b = -alpha sin i and
    q = beta^2 + (alpha^2 - a^2) cos^2 i (Bardeen 1973). At a finite radius r a direction at the angle psi from the hole
    has the length 2 r tan(psi / 2).

    The observer moves like the FIDO: its velocity, in terms of a `Camera`, is "fiducial".

    Times are those of a plane wave, without the travel time from the hole to the observer: r + 2 ln r is subtracted.
    The accuracy is the same for every radius.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.shadow_edge(kc.Observer(spin=0.9, inclination=1.0), 100).shape
    (100, 2)
    """

    spin: float = quantity("", "1", "spin a of the hole")
    inclination: float = quantity("", "rad", "polar angle", given=True)
    radius: float = quantity("", "GM/c^2", "Boyer-Lindquist radius", default=math.inf)
    sky_unit: ClassVar[str] = "GM/c^2"
    sky_coordinates: ClassVar[str] = "alpha, beta"

    def __post_init__(self) -> None:
        """Raise ValueError unless there is such an observer."""
        for name in ("spin", "inclination"):
            object.__setattr__(self, name, finite_number(name, getattr(self, name)))
        infinite = real_number("radius", self.radius) == math.inf
        object.__setattr__(self, "radius", math.inf if infinite else finite_number("radius", self.radius))
        check_place(self.spin, min(self.radius, LARGEST_RADIUS) if infinite else self.radius, self.inclination)

    @property
    @derived("", "")
    def velocity(self) -> str:
        """Motion, by the name that it has for a `Camera`."""
        return "fiducial"

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the numbers that give the place: the radius is none at infinity."""
        return tuple(name for name in super().parameters if name != "radius" or math.isfinite(self.radius))

    @property
    def straight_ahead(self) -> float:
        """1 - cos of the angle to the end of the screen, far outside the primary critical curve."""
        farthest = min(_BEYOND_PRIMARY * math.sqrt(self.radius), _FARTHEST)
        return 2 / (1 + (farthest / (2 * SCREEN)) ** 2)

    def at_rest(self) -> "Observer":
        """The observer, who is at rest."""
        return self

    def frame(self) -> Frame:
        """The observer's numbers for compiled code."""
        return _frame(self)

    def orbital_velocity(self) -> float:
        """0: the observer is at rest."""
        return 0.0

    def directions(self, sky: Any) -> Any:
        """Directions (..., 3), as engines take them, of places (alpha, beta) (..., 2) on the screen."""
        return from_screen(sky)

    def places(self, sky: np.ndarray) -> np.ndarray:
        """Places (alpha, beta) (..., 2) on the screen, of directions (..., 3) as engines take them."""
        return on_screen(sky)

    def tangents(self, sky: np.ndarray) -> np.ndarray:
        """Unit steps along alpha and beta (..., 2, 2)."""
        return np.broadcast_to(np.eye(2), (*sky.shape[:-1], 2, 2))

    def by_places(self, sky: Any, jacobian: np.ndarray) -> np.ndarray:
        """Jacobians by beta and alpha: in this order the determinant has the sign of the parity."""
        directions = from_screen(sky)
        (along_alpha, along_beta), tangents = screen_basis(directions), np.stack(tangent_basis(directions), axis=-2)
        return jacobian @ tangents @ np.stack([along_beta, along_alpha], axis=-1)


@lru_cache(maxsize=64)
def _frame(observer: Observer) -> Frame:
    radius = min(observer.radius, _INFINITE)
    frame, zoom = frame_at(observer, radius), SCREEN / radius
    return frame._replace(cylindrical_scale=zoom * frame.cylindrical_scale, zoom=zoom, start=0.0)


def from_screen(place: ArrayLike) -> np.ndarray:
    """The directions (..., 3), as engines take them, of places (alpha, beta) (..., 2) on a screen."""
    places = real_array("sky", place)
    if places.ndim == 0 or places.shape[-1] != 2:
        raise ValueError(
            "Argument `sky` must have shape (..., 2) for an Observer, places (alpha, beta) in units of M, but has "
            f"{places.shape}."
        )
    if not np.isfinite(places).all():
        raise ValueError("Argument `sky` must hold finite numbers (alpha, beta).")
    return np.stack(sphere_parts(places[..., 0], places[..., 1]), axis=-1)


def sphere_parts(alpha: Any, beta: Any) -> tuple[Any, Any, Any]:
    """The three components of such a direction, floats or arrays, of JAX too."""
    a, b = alpha / (2 * SCREEN), beta / (2 * SCREEN)
    square = a * a + b * b
    return (square - 1) / (1 + square), 2 * a / (1 + square), 2 * b / (1 + square)


def on_screen(sky: np.ndarray) -> np.ndarray:
    """Places (alpha, beta) (..., 2) on a screen, of directions (..., 3) as engines take them."""
    _, y, z = np.moveaxis(sky, -1, 0)
    near = _from_far(sky)
    with np.errstate(divide="ignore", invalid="ignore"):
        return 2 * SCREEN * np.stack([y, z], axis=-1) / near[..., None]


def _from_far(sky: np.ndarray) -> np.ndarray:
    """1 - x (...), without the cancellation of the direction away from the hole."""
    x, y, z = np.moveaxis(sky, -1, 0)
    return np.where(x < 0, 1 - x, (y * y + z * z) / np.where(x < 0, 1, 1 + x))


def screen_basis(sky: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The changes of directions (..., 3) with alpha and with beta, each (..., 3), per M."""
    _, y, z = np.moveaxis(sky, -1, 0)
    near = _from_far(sky)
    along_alpha = np.stack([y * near, near - y * y, -y * z], axis=-1)
    along_beta = np.stack([z * near, -y * z, near - z * z], axis=-1)
    return along_alpha / (2 * SCREEN), along_beta / (2 * SCREEN)
