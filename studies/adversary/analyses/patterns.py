"""Diffraction patterns: the field in pixels, against that of one source at each, if possible by another method.

A pattern interpolates the integrals of rings; `amplification` sums images, or integrates for the source itself. Both
errors are allowed for.
"""

import math
from typing import Any

import numpy as np

import kerrcaustics as kc

from .claim import Claim, Kind
from .gradients import ordinary_camera, ordinary_observer

# Pixels on each side, and how many of them are compared.
_SIDE, _COMPARED = 5, 3
_METHODS = ("auto", "images", "line")


def of_patterns(rng: np.random.Generator) -> list[Claim]:
    """Pixels of the pattern of a region next to a caustic."""
    viewer = ordinary_camera(rng) if rng.uniform() < 0.7 else ordinary_observer(rng)
    caustic = kc.caustics(viewer, 2)[rng.integers(2)]
    place = caustic.place[rng.integers(len(caustic.place))]
    half = 10 ** rng.uniform(-3, -1)
    middle = place + rng.uniform(-1, 1, 2) * half
    theta = np.clip([middle[0] - half, middle[0] + half], 1e-3, math.pi - 1e-3).tolist()
    phi = [float(middle[1] - half), float(middle[1] + half)]
    frequency, index = float(10 ** rng.uniform(-0.5, 2.5)), int(rng.integers(1, 3))
    region = (tuple(theta), tuple(phi))
    code = f"kc.diffraction_pattern({viewer!r}, {region!r}, {frequency!r}, max_index={index}, pixels={_SIDE})"
    try:
        pattern = kc.diffraction_pattern(viewer, region, frequency, max_index=index, pixels=_SIDE)
    except ValueError:
        # No ring in some part of the region, or fringes that need too many lines of sight.
        return []
    pixels = rng.choice(_SIDE**2, _COMPARED, replace=False).tolist()
    return pattern_claims(pattern, pixels, str(rng.choice(_METHODS)), code)


def pattern_claims(pattern: Any, pixels: list[int], method: str, code: str) -> list[Claim]:
    """Claims of the field in pixels of these numbers, row by row."""
    claims = []
    for pixel in pixels:
        row, column = divmod(pixel, len(pattern.phi))
        source = float(pattern.theta[row]), float(pattern.phi[column])
        one = kc.amplification(pattern.camera, source, pattern.frequency, max_index=pattern.max_index, method=method)
        off = abs(pattern.value[row, column] - one.value[0])
        allowed = pattern.error[row, column] + one.error[0]
        if math.isfinite(allowed):
            claims.append(Claim("diffraction patterns", float(off / allowed), f"{code}, row {row}, column {column}"))
    return claims


KINDS: dict[str, Kind] = {"diffraction patterns": of_patterns}
