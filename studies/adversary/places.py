"""Do images of stars lie where they claim, and do their values belong there?

    python -m studies.adversary.places REFINED MOVING [SEED]

- Refined images: directions 1e-7 to 1e-2 shadow sizes outside the shadow edge of a hole with any spin to 1 - 1e-12, one
  in two above 1 - 1e-6, are traced to the celestial sphere or to one beyond the camera. The image of the star that lies
  there is refined with its distance from the shadow edge held beside N. Its place and time are compared with the truth
  in long arithmetic (true_images.py), in units of the reported errors.
- Moving cameras: the images of stars, seen with any velocity to 0.99 at a few events. One star in two lies beside a
  caustic. Their places, magnifications and frequency ratios are compared with the truth on the sky of the moving
  camera; all else that is said of them with a beam traced at that place.

Prints what was tried, and every counterexample as a line of Python.
"""

import math
import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.ends import SKY, Sphere
from kerrcaustics.images.deep_images import refined_at_shadow_edge
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import from_angles, polar_angle

from ..directions import off_the_edge
from ..stability.problems import edge_scale
from .trials import place_of
from .true_images import true_image

# True error over reported error that is still a kept promise.
HONEST = 10.0
# Seconds after which the truth of an image is given up, and images of one camera.
_PATIENCE, _TOGETHER = 20.0, 8
# Of values that are computed twice at one place, relative.
_SAME = 1e-13
_LIGHT = ("magnification", "redshift")
_EVENTS = ((0.9, 10.0, 1.2), (0.6, 4.0, 2.0), (0.998, 20.0, 0.7))


class Claim(NamedTuple):
    """True over reported error of one number, what it is, and the call."""

    ratio: float
    name: str


def fast_holes(seed: int) -> Iterator[tuple[kc.Camera, float]]:
    """Random cameras at rest, most of them at nearly extremal holes, and radii of spheres beyond them."""
    rng = np.random.default_rng(seed)
    while True:
        spin = 1 - 10 ** float(rng.choice([rng.uniform(-12, -6), rng.uniform(-6, 0)]))
        radius = float(kerr.horizon(spin) + 10 ** rng.uniform(-1, 1.5))
        inclination = float(rng.choice([math.pi / 2, math.acos(rng.uniform(-1, 1)), 10 ** rng.uniform(-5, -1)]))
        end = math.inf if rng.uniform() < 0.5 else float(radius * 10 ** rng.uniform(0.05, 2))
        yield kc.Camera(spin, radius, inclination, "fiducial"), end


def refined_claims(camera: kc.Camera, end: float, rng: np.random.Generator, most: int = _TOGETHER) -> list[Claim]:
    """Places and times of refined images of index 2 and more; most: how many of them."""
    distance = 10 ** rng.uniform(-7, -2, _TOGETHER) * min(edge_scale(camera), 1.0)
    sky = off_the_edge(camera, rng.uniform(0, 2 * math.pi, _TOGETHER), distance)
    beams = kc.trace_beams(camera, sky, end=end)
    good = np.flatnonzero(beams.escaped & (np.asarray(beams.index) >= 2))[:most]
    if not len(good):
        return []
    n = beams.direction[good]
    stars = np.stack([polar_angle(n), np.arctan2(n[:, 1], n[:, 0])], axis=-1)
    surface = SKY if math.isinf(end) else Sphere(end)
    doubt, leaf = np.full(len(good), math.inf), np.zeros(len(good), bool)
    deep = refined_at_shadow_edge(camera, sky[good], doubt, from_angles(*stars.T), surface, leaf)
    claims = []
    for i, place, error, time, late in zip(*deep, strict=True):
        star = (float(stars[i, 0]), float(stars[i, 1]))
        name = f"of {star} next to N {place.tolist()}, {camera!r}, end={end!r}"
        claims += _against_truth(camera, place, star, end, (error, time, late), name)
    return claims


def moving_claims(camera: kc.Camera, star: tuple[float, float], end: float = math.inf) -> list[Claim]:
    """Places, times and all values of the images of a star."""
    images = kc.star_images(camera, star, end=end)
    name = f"of kc.star_images({camera!r}, {star!r}, end={end!r})"
    claims = value_claims(camera, images, name)
    for i in range(len(images)):
        time, late = (None, None) if images.time is None else (images.time[i], images.time_error[i])
        light = {what: (getattr(images, what)[i], getattr(images, f"{what}_error")[i]) for what in _LIGHT}
        said = images.error[i], time, late
        claims += _against_truth(camera, images.sky[i], star, end, said, f"{name}, image {i}", light)
    return claims


def value_claims(camera: kc.Camera, images: kc.StarImages, name: str) -> list[Claim]:
    """Values of images against beams at their places: differences over what is allowed."""
    beams = kc.trace_beams(camera, images.sky, "auto", 1e-12, end=images.surface)
    off = {
        "magnification": images.magnification / beams.magnification - 1,
        "redshift": images.redshift / beams.redshift - 1,
        "index": np.where(beams.index_certain, images.index - beams.index, 0),
        "crossings": np.where(images.crossings_certain, images.crossings - beams.crossings, 0),
    }
    worst = {what: float(np.abs(values).max(initial=0)) / _SAME for what, values in off.items()}
    miss = np.linalg.norm(beams.direction - from_angles(*images.star), axis=1)
    worst["star"] = float((miss / (images.error * beams.delta_plus + beams.error)).max(initial=0))
    return [Claim(ratio, f"{what} {name}") for what, ratio in worst.items()]


def _against_truth(camera, sky, star, end, said, name: str, light: dict | None = None) -> list[Claim]:
    """Place and time of an image: nothing where the truth takes too long, or where there is no such image nearby.

    light: the magnification and the frequency ratio with their errors, which are compared, too.
    """
    error, time, late = said
    try:
        true = true_image(place_of(camera), sky.tolist(), star, end, _PATIENCE)
    except TimeoutError:
        return []
    if true is None:
        return []
    away = max(float(np.linalg.norm(true.away)) - true.blur, 0.0)
    claims = [Claim(away / float(error), f"place {name}")]
    if time is not None:
        claims.append(Claim(abs(float(time) - true.ray.time) / float(late), f"time {name}"))
    truth = {"magnification": 1 / float(np.prod(np.linalg.svd(true.ray.columns)[1])), "redshift": true.ray.redshift}
    claims += [
        Claim(abs(value - truth[what]) / off, f"{what}_error {name}") for what, (value, off) in (light or {}).items()
    ]
    return claims


def moving_cameras(seed: int) -> Iterator[tuple[kc.Camera, tuple[float, float]]]:
    """Cameras with any velocity to 0.99 at a few events, and a star for each: anywhere, or beside a caustic."""
    rng = np.random.default_rng(seed)
    while True:
        for event in _EVENTS:
            way = rng.normal(size=3)
            speed = 0.99 * rng.uniform() ** 0.3
            camera = kc.Camera(*event, tuple((speed * way / np.linalg.norm(way)).tolist()))
            yield camera, (float(np.arccos(rng.uniform(-1, 1))), float(rng.uniform(-math.pi, math.pi)))
            curve = from_angles(*kc.caustics(camera, 3)[rng.integers(3)].place.T)
            place = curve[rng.integers(len(curve))] + 10 ** rng.uniform(-9, -2) * rng.normal(size=3)
            yield camera, (float(polar_angle(place / np.linalg.norm(place))), float(np.arctan2(place[1], place[0])))


def broken(claims: list[Claim]) -> list[str]:
    """Claims that do not hold, in words."""
    return [f"{claim.ratio:.3g} times what is reported: {claim.name}" for claim in claims if not claim.ratio <= HONEST]


def main() -> None:
    refined, moving, seed = (*(int(word) for word in sys.argv[1:]), *(10, 10, 1)[len(sys.argv) - 1 :])
    rng, claims = np.random.default_rng((seed, 1)), []
    for _, (camera, end) in zip(range(refined), fast_holes(seed), strict=False):
        claims += refined_claims(camera, end, rng)
    for _, (camera, star) in zip(range(moving), moving_cameras(seed), strict=False):
        claims += moving_claims(camera, star)
    for what in dict.fromkeys(claim.name.split()[0] for claim in claims):
        ratios = [claim.ratio for claim in claims if claim.name.split()[0] == what]
        print(f"{what}: {len(ratios)} claims, at most {max(ratios):.3g} of what is reported")
    print("\n".join(broken(claims)) or "no claim is broken")


if __name__ == "__main__":
    main()
