"""Waiting times of users, line by line: each is measured in a process of its own."""

import json
import math
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

import kerrcaustics as kc
from kerrcaustics.report.machine import one_core

from .stages import Stages, watched

Work = Callable[[int], object]

STAR, NORMAL, FURTHER = (1.4, 2.9), (1.2, 0.4), 1e-3
# Nothing is repeated any more after so many seconds.
_LONGEST = 4.0
_APART = "import sys; from kerrcaustics.scripts import STUDIES; STUDIES.module('cost.lines').answer(sys.argv[1])"


@dataclass(frozen=True)
class Sizes:
    """Sizes of the lines: stars, times of the light curve, rows of the map, pixels of the frames."""

    stars: int = 1000
    times: int = 1000
    rows: int = 180
    width: int = 960
    height: int = 540


SIZES = Sizes()
"""Those of the study."""


def _camera(k: int) -> kc.Camera:
    """Another camera for each call, as what is known of the last one is kept."""
    return kc.Camera(0.999, 6.03 + FURTHER * k)


def _first_star(sizes: Sizes) -> Work:
    images = kc.star_images
    return lambda k: images(_camera(k), STAR)


def _one_more_star(sizes: Sizes) -> Work:
    images, camera = kc.star_images, _camera(0)
    return lambda k: images(camera, (STAR[0], STAR[1] + 0.01 * k))


def _many_stars(sizes: Sizes) -> Work:
    counts, random = kc.image_counts, np.random.default_rng(2015)
    theta, phi = np.arccos(random.uniform(-1, 1, sizes.stars)), random.uniform(0, 2 * math.pi, sizes.stars)
    return lambda k: counts(_camera(k), np.stack([theta, phi], axis=-1))


def _caustics(sizes: Sizes) -> Work:
    caustics = kc.caustics
    return lambda k: caustics(_camera(k), 3)


def _circle(sizes: Sizes) -> Work:
    images = kc.circle_images
    return lambda k: images(_camera(k), NORMAL)


def _tracks(sizes: Sizes) -> Work:
    tracks = kc.star_tracks
    return lambda k: tracks(_camera(k), STAR[0])


def _light_curve(sizes: Sizes) -> Work:
    light = kc.light_curve
    return lambda k: light(kc.Camera(0.9, 30 + FURTHER * k, 1.2), 8.0, sizes.times)


def _count_map(sizes: Sizes) -> Work:
    counts = kc.count_map
    return lambda k: counts(_camera(k), rows=sizes.rows)


def _star_frame(sizes: Sizes) -> Work:
    return _frames(sizes, 150, _camera, kc.skies.StarField(band=0.15), colour_shift=True, beaming=True)


def _checkerboard(sizes: Sizes) -> Work:
    return _frames(sizes, 240, lambda k: kc.Camera(0.999, 2.6 + FURTHER * k), kc.skies.Checkerboard(15, 30))


def _disk(sizes: Sizes) -> Work:
    disk = kc.disks.Disk(4.5, 18.7, kc.disks.PageThorne(6500))

    def camera(k: int) -> kc.Camera:
        return kc.Camera(0.6, 74.1 + FURTHER * k, math.radians(86.56), "static")

    return _frames(sizes, 40, camera, disk=disk, colour_shift=True, beaming=True)


def _frames(sizes: Sizes, degrees: float, camera: Callable[[int], kc.Camera], *sky: Any, **options: Any) -> Work:
    """Pictures as they are shown: light, and its tones."""
    render, tone_mapped = kc.render, kc.pictures.tone_mapped
    view = kc.pictures.View(sizes.width, sizes.height, math.radians(degrees), "fisheye")
    return lambda k: tone_mapped(render(camera(k), view, *sky, **options).light)


LINES: dict[str, Callable[[Sizes], Work]] = {
    "first star": _first_star,
    "one more star": _one_more_star,
    "{stars:,} stars": _many_stars,
    "three caustics": _caustics,
    "great circle": _circle,
    "tracks of a star": _tracks,
    "light curve, {times:,} times": _light_curve,
    "count map, {rows} rows": _count_map,
    "frame of stars": _star_frame,
    "frame of a checkerboard": _checkerboard,
    "frame of a disk": _disk,
}
"""Work of each line, by its name, for sizes: it is given the number of the call."""


def line(name: str, sizes: Sizes, repeats: int) -> dict[str, Any]:
    """A line, in a process of its own: its first call and, with repeats, its later ones, as `measured` has them."""
    request = json.dumps({"name": name, "sizes": asdict(sizes), "repeats": repeats, "began": time.time()})
    command = [sys.executable, "-c", _APART, request]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def answer(request: str) -> None:
    """Print what `measured` finds, for the process that asked."""
    print(json.dumps(measured(**json.loads(request))), flush=True)


def measured(name: str, sizes: dict[str, int], repeats: int, began: float) -> dict[str, Any]:
    """Seconds of a line in this process, which began at a time.

    `first`: start of the process with its imports, and the stages of the first call, as time goes by on all cores.
    With repeats, `later`: stages of the fastest call, in processor time on one core; `traced`: its rays and beams;
    `speed_up`: that of calls on all cores.
    """
    work = LINES[name](Sizes(**sizes))
    start = time.time() - began
    with watched(time.perf_counter) as first:
        work(0)
    found: dict[str, Any] = {"first": {"start": start, **first.seconds}}
    if not repeats:
        return found
    on_all = _calls(work, range(1, repeats + 1))
    with one_core():
        on_one = _calls(work, range(repeats + 1, 2 * repeats + 1))
    _, best = min(on_one, key=lambda call: sum(call[1].seconds.values()))
    speed_up = min(map(_taken, on_one)) / min(map(_taken, on_all))
    return found | {"later": best.seconds, "traced": best.traced, "speed_up": speed_up}


def _taken(call: tuple[float, Stages]) -> float:
    return call[0]


def _calls(work: Work, numbers: range) -> list[tuple[float, Stages]]:
    """Seconds and stages of some calls."""
    calls: list[tuple[float, Stages]] = []
    for k in numbers:
        if sum(map(_taken, calls)) > _LONGEST:
            break
        began = time.perf_counter()
        with watched(time.process_time) as stages:
            work(k)
        calls.append((time.perf_counter() - began, stages))
    return calls
