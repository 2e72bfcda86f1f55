"""The light of small balls, at rest and on circles, against rays that meet them: the slow twin of the tests.

The twin is tests/moving_ball.py, so that a checkout has this kind, and an installed package does not.
"""

import math
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr

from .claim import Claim, Kind
from .hard_viewers import Random, one_of, power

_TESTS = Path(__file__).parents[3] / "tests"
# Accuracy of the twin: of a ball at rest by its limb, of one in motion by cells.
_AT_REST, _MOVING = 1e-7, 3e-4


def ball_claims(rng: Random) -> list[Claim]:
    """The light of one image of a ball."""
    spin = one_of(rng, 0.0, rng.uniform(0, 0.999), 1 - power(rng, -4, -1))
    camera = kc.Camera(spin, 8 + power(rng, 0, 1.7), math.acos(rng.uniform(-0.95, 0.95)), "fiducial")
    moving, event = rng.uniform() < 0.3, (camera.spin, camera.radius, camera.inclination)
    radius = kerr.isco(spin) * (1 + power(rng, -6, 0)) if moving else 2.3 + power(rng, -1, 1)
    place = radius, math.acos(rng.uniform(-0.9, 0.9)), float(rng.uniform(0, 2 * math.pi))
    orbital = 1 / (spin + radius**1.5)
    size, time = radius * power(rng, -4, -1.05), float(rng.uniform(0, 100))

    def at_rest(_t: Any) -> tuple[float, float, float]:
        return place

    def circling(t: Any) -> tuple[Any, Any, Any]:
        return radius, math.pi / 2, orbital * t

    orbit: Any = radius if moving else at_rest
    light = kc.light_curve(camera, orbit, [time], source=kc.Ball(size), max_index=1, searches=4)
    words = f"{radius!r}" if moving else f"lambda t: {place!r}"
    code = f"kc.light_curve({camera!r}, {words}, [{time!r}], source=kc.Ball({size!r}), max_index=1, searches=4)"
    seen = np.flatnonzero(np.isfinite(light.emission_time[:, 0]))
    if not (light.certified and len(seen)):
        return []
    image = int(rng.choice(seen))
    true = _true_light(event, circling if moving else at_rest, size, time, (light, image))
    if true is None:
        return []
    # The error is that of all images.
    allowed = light.error[0] + (_MOVING if moving else _AT_REST) * true
    name = "light in motion" if moving else "light at rest"
    return [Claim(name, float(abs(light.shares[image, 0] - true) / allowed), f"{code}.shares[{image}, 0]")]


def _true_light(event: tuple, places: Any, size: float, time: float, image: tuple[Any, int]) -> float | None:
    """The flux of an image; None where the twin does not find its way round the image."""
    if str(_TESTS) not in sys.path:
        sys.path.append(str(_TESTS))
    twin, equations = import_module("moving_ball"), import_module("beam_equations")
    light, which = image
    method = twin.light_at_rest if places.__name__ == "at_rest" else twin.ball_light
    try:
        found = method(
            equations.Event(*event),
            places,
            size,
            time,
            (light.sky[which, 0], light.emission_time[which, 0]),
        )
    except AssertionError:
        return None
    return found / (4 * math.pi)


KINDS: dict[str, Kind] = {"balls": ball_claims} if (_TESTS / "moving_ball.py").is_file() else {}
