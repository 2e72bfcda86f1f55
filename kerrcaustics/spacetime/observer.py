"""Distant observers, and their screens: a sky in units of the mass."""

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.results.declared import LAYOUTS
from kerrcaustics.spacetime.camera import LARGEST_RADIUS, Camera, Frame
from kerrcaustics.spacetime.checks import numbers

# In double precision the limit: 1 / radius is nothing beside 1, and its twelfth power is still a number.
_INFINITE = 1e20
# The screen becomes a sphere on which the hole is as large as for a camera at this radius.
_SCREEN = 10.0
# How far out critical curves are looked for: in sqrt(radius), of which the primary has two, and in M.
_BEYOND_PRIMARY, _FARTHEST = 20.0, 1e7


class Observer(Camera):
    """A fiducial observer far away, who measures directions by the impact parameters of a plane wave.

    Parameters
    ----------
    spin : float
        Spin a of the hole, 0 <= a < 1, along +z (units of the mass).
    inclination : float
        Polar angle of the observer in radians, 0 to pi.
    radius : float, optional
        Boyer-Lindquist radius, at most 1e9, or infinite.

    Notes
    -----
    The sky has two coordinates (alpha, beta) in units of M, from the direction to the hole: alpha grows toward e_phi,
    to the right where the spin axis points up, beta toward it. At infinity b = -alpha sin i and q = beta^2 + (alpha^2 -
    a^2) cos^2 i (Bardeen 1973). At a finite radius r a direction at the angle psi from the hole has the length
    2 r tan(psi / 2).

    The motion is that of the FIDO: velocity, as of a `Camera`, is "fiducial".

    Times are those of a plane wave, without what it takes from the hole to the observer: r + 2 ln r is taken off. All
    is as accurate for every radius.
    """

    is_distant: ClassVar[bool] = True

    def __init__(self, spin: float, inclination: float, radius: float = math.inf) -> None:
        """Refuse an observer that cannot be there."""
        infinite = isinstance(radius, float) and radius == math.inf
        super().__init__(spin, LARGEST_RADIUS if infinite else radius, inclination, "fiducial")
        if infinite:
            object.__setattr__(self, "radius", math.inf)

    def at_rest(self) -> "Observer":
        """The observer, who is at rest."""
        return self

    def frame(self) -> Frame:
        """The observer's numbers for compiled code."""
        return _frame(self)


LAYOUTS[Observer] = replace(LAYOUTS[Camera], schema="kerrcaustics/observer/1")


@lru_cache(maxsize=64)
def _frame(observer: Observer) -> Frame:
    radius = min(observer.radius, _INFINITE)
    far = object.__new__(Camera)
    for name, value in (vars(observer) | {"radius": radius}).items():
        object.__setattr__(far, name, value)
    frame, zoom = far.frame(), _SCREEN / radius
    return frame._replace(cylindrical_scale=zoom * frame.cylindrical_scale, zoom=zoom, start=0.0)


def is_screen(camera: object, sky: Any) -> bool:
    """Whether directions are given as places (..., 2) on an observer's screen."""
    return isinstance(camera, Observer) and np.ndim(sky) > 0 and np.shape(sky)[-1] == 2


def straight_ahead(camera: Camera) -> float:
    """1 - cos of the angle, on the sphere of the engines, from the direction away from the hole to the screen's end.

    Beyond it, far outside the primary critical curve, the sphere has no digits left for rays; 0 for other cameras.
    """
    farthest = min(_BEYOND_PRIMARY * math.sqrt(camera.radius), _FARTHEST) if camera.is_distant else math.inf
    return 2 / (1 + (farthest / (2 * _SCREEN)) ** 2)


def from_screen(place: ArrayLike) -> np.ndarray:
    """The directions (..., 3), as engines take them, of places (alpha, beta) (..., 2) on a screen."""
    places = numbers("sky", place)
    if not np.isfinite(places).all():
        raise ValueError("Argument `sky` must hold finite numbers (alpha, beta).")
    a, b = np.moveaxis(places / (2 * _SCREEN), -1, 0)
    square = a * a + b * b
    return np.stack([square - 1, 2 * a, 2 * b], axis=-1) / (1 + square)[..., None]


def on_screen(sky: np.ndarray) -> np.ndarray:
    """Places (alpha, beta) (..., 2) on a screen, of directions (..., 3) as engines take them."""
    _, y, z = np.moveaxis(sky, -1, 0)
    near = _from_far(sky)
    with np.errstate(divide="ignore", invalid="ignore"):
        return 2 * _SCREEN * np.stack([y, z], axis=-1) / near[..., None]


def _from_far(sky: np.ndarray) -> np.ndarray:
    """1 - x (...), without the cancellation of the direction away from the hole."""
    x, y, z = np.moveaxis(sky, -1, 0)
    return np.where(x < 0, 1 - x, (y * y + z * z) / np.where(x < 0, 1, 1 + x))


def screen_basis(sky: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How directions (..., 3) change with alpha and with beta, each (..., 3), per M."""
    _, y, z = np.moveaxis(sky, -1, 0)
    near = _from_far(sky)
    along_alpha = np.stack([y * near, near - y * y, -y * z], axis=-1)
    along_beta = np.stack([z * near, -y * z, near - z * z], axis=-1)
    return along_alpha / (2 * _SCREEN), along_beta / (2 * _SCREEN)
