"""Does a picture of the whole sky keep the light of a star?

    python -m studies.adversary.star_light PICTURES [SEED]

Random cameras (spins 0 to 0.999, 1.5 horizons to 1e3, any inclination, at rest and to 0.9 of the speed of light), each
with an equirectangular picture of its whole sky, 24 x 12 to 480 x 240 pixels, turned at random, and random stars. The
light of all pixels together, times their solid angles, is compared with the magnifications of `star_images`, summed
over all images to index 4, or as high as its search goes. Those that are not certified are left out.

Prints what was tried, and every picture that is off by more than a hundredth as a line of Python.
"""

import math
import sys
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.images.images import StarImages
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.scenes.rendering import Rendering
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import from_angles

# Relative difference that is allowed: that of the pixels' filter, the map, and the strip next to the shadow edge.
ALLOWED = 0.01
# Stars of one picture, and the largest index of their images.
_STARS, _INDEX = 20, 4
_WIDTHS = (24, 48, 96, 160, 240, 480)


class Light(NamedTuple):
    """Of one star: relative difference of a picture's light, what images bring, and both as Python."""

    off: float
    magnification: float
    name: str


def whole_skies(seed: int) -> Iterator[tuple[kc.Camera, kc.pictures.View, np.random.Generator]]:
    """Random cameras, pictures of their whole sky, and a source of stars."""
    for number in range(1 << 30):
        rng = np.random.default_rng((seed, number))
        spin = float(rng.choice([0.0, 10 ** rng.uniform(-3, -0.5), rng.uniform(0, 0.999), 0.999]))
        radius = min(float(kerr.horizon(spin) * (1 + 10 ** rng.uniform(-0.3, 2.7))), 1e3)
        inclination = float(rng.choice([math.pi / 2, math.acos(rng.uniform(-1, 1))]))
        way = rng.normal(size=3)
        speed = float(rng.choice([0.0, rng.uniform(0, 0.9)]))
        camera = kc.Camera(spin, radius, inclination, tuple((speed * way / np.linalg.norm(way)).tolist()))
        width = int(rng.choice(_WIDTHS))
        forward, up = rng.normal(size=(2, 3))
        yield camera, kc.pictures.View(width, width // 2, 2 * math.pi, "equirectangular", forward, up), rng


def one_star(star: tuple[float, float]) -> kc.skies.StarField:
    """A sky of one star of magnitude 0."""
    catalogue = kc.skies.StarCatalogue(from_angles(*star)[None], np.zeros(1), np.full(1, 0.65))
    return kc.skies.StarField(catalogue, orientation=np.eye(3), band=0)


def received(scene: Rendering) -> float:
    """Light of all pixels together: luminance times solid angle."""
    x, y = np.meshgrid(np.arange(scene.view.width), np.arange(scene.view.height))
    return float((luminance(scene.light) * scene.view.solid_angle(scene.view.directions(x, y)[1])).sum())


def star_light(camera: kc.Camera, view: kc.pictures.View, stars: list[tuple[float, float]]) -> list[Light]:
    """Errors of the light of stars in a picture, of those whose images are certified."""
    traced, found = kc.pictures.trace_view(camera, view), []
    for star in stars:
        images = _images(camera, star)
        if images is None or not images.certified:
            continue
        light = float(images.magnification.sum())
        off = received(traced.show(one_star(star))) / light - 1
        axes = tuple(tuple(axis.tolist()) for axis in (view.forward, view.up))
        name = f"{camera!r}, star {star!r}, {view.width} x {view.height}, forward {axes[0]}, up {axes[1]}"
        found.append(Light(off, light, f"{off:+.3g}: {name}; index 0 to {images.index.max()}: {light:.6g}"))
    return found


def _images(camera: kc.Camera, star: tuple[float, float]) -> StarImages | None:
    for index in range(_INDEX, 0, -1):
        try:
            return kc.star_images(camera, star, max_index=index)
        except ValueError:
            continue
    return None


def random_stars(rng: np.random.Generator, count: int) -> list[tuple[float, float]]:
    """Directions theta', phi'."""
    return [(math.acos(rng.uniform(-1, 1)), rng.uniform(-math.pi, math.pi)) for _ in range(count)]


def try_all(
    pictures: int, seed: int = 1866, report: Callable[[object], None] = lambda _line: None
) -> tuple[dict[str, float], list[str]]:
    """So many pictures of a star: the differences in numbers, and those pictures that are off by more than allowed."""
    found: list[Light] = []
    tried, skies = 0, whole_skies(seed)
    while tried < pictures:
        camera, view, rng = next(skies)
        count = min(_STARS, pictures - tried)
        tried += count
        new = star_light(camera, view, random_stars(rng, count))
        found += new
        report((tried, numbers(found)))
        for one in new:
            if not abs(one.off) <= ALLOWED:
                report(one.name)
    return {"pictures": tried, **numbers(found)}, [one.name for one in found if not abs(one.off) <= ALLOWED]


def numbers(found: list[Light]) -> dict[str, float]:
    """The number that is certified, their median and largest difference, and the number off by more than allowed."""
    off = np.abs([one.off for one in found] or [0.0])
    worst = {"median": float(np.median(off)), "99 %": float(np.quantile(off, 0.99)), "largest": float(off.max())}
    return {"certified": len(found), **worst, "beyond 1 %": int((~(off <= ALLOWED)).sum())}


if __name__ == "__main__":
    tally, broken = try_all(*(int(word) for word in sys.argv[1:]), report=partial(print, flush=True))
    print(tally)
    print("\n".join(broken) or "no light is lost")
