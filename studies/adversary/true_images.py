"""The true place of an image in long arithmetic: Newton's method on the rays of truth.py, from a place close by.

Shares no code with the package.
"""

import math
import time
from typing import NamedTuple

import numpy as np
from mpmath import mp, mpf

from ..truth.camera import Place, unit
from ..truth.rays import displaced, tangent_basis
from .truth import DIGITS, End, Known, known

# Newton steps, and the distance of n' from the star (radians) that doubles cannot distinguish from none.
_STEPS, _SETTLED = 10, 3e-16


class TrueImage(NamedTuple):
    """A true image: its N less the place from which it was found (3,), what is true of its ray, and its own error.

    blur: of N, radians, as the ends of rays are known here to doubles.
    """

    away: np.ndarray
    ray: Known
    blur: float


def true_image(
    place: Place, sky: list, star: tuple[float, float], end: End, most_seconds: float = math.inf
) -> TrueImage | None:
    """The image of a star (theta', phi') next to a direction N; None where Newton's method does not lead to one.

    Raises TimeoutError for one that takes too long.
    """
    latest = time.process_time() + most_seconds
    with mp.workdps(DIGITS + 15):
        theta, phi = (mpf(x) for x in star)
        goal = [mp.sin(theta) * mp.cos(phi), mp.sin(theta) * mp.sin(phi), mp.cos(theta)]
        start = n = unit([mpf(x) for x in sky])
        for _ in range(_STEPS):
            ray = known(place, n, end, most_seconds=latest - time.process_time())
            if not isinstance(ray, Known):
                return None
            missing = np.array([float(g - mpf(x)) for g, x in zip(goal, ray.direction, strict=True)])
            step, *_, widths = np.linalg.lstsq(ray.columns, missing)
            if np.linalg.norm(missing) < _SETTLED:
                away = np.array([p - q for p, q in zip(n, start, strict=True)], float)
                return TrueImage(away, ray, _SETTLED / widths[-1])
            for tangent, part in zip(tangent_basis(n), step.tolist(), strict=True):
                n = displaced(n, tangent, mpf(part))
            n = unit(n)
    return None
