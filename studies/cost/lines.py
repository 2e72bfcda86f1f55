"""Waiting times of users, line by line: each is measured in a process of its own, with nothing but its programs."""

import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.compile_cache import cache_folder
from kerrcaustics.report.machine import one_core

from .stages import Stages, watched

Work = Callable[[int], object]

STAR, NORMAL, FURTHER = (1.4, 2.9), (1.2, 0.4), 1e-3
# Nothing is repeated any more after so many seconds.
_LONGEST = 4.0
# A process is at rest if it takes less than a tenth of a core for so many seconds.
_AT_REST = 0.2
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
    """A line: seconds of its first call and of later ones by stage, and how many rays and beams those trace.

    All in a process of its own that loads its programs from the user's cache.
    """
    kept = _kept()
    found = _apart(name, sizes, repeats, None)
    # What had to be compiled is there now.
    return found if _kept() <= kept else _apart(name, sizes, repeats, None)


def first_use(name: str, sizes: Sizes) -> dict[str, dict[str, Any]]:
    """The first call of a line in a new process: with an empty cache, and with what that has left there."""
    with tempfile.TemporaryDirectory() as cache:
        return {state: _apart(name, sizes, 0, cache) for state in ("empty", "warm")}


def _kept() -> set[str]:
    folder = cache_folder()
    return {path.name for path in folder.iterdir()} if folder and folder.is_dir() else set()


def _apart(name: str, sizes: Sizes, repeats: int, cache: str | None) -> dict[str, Any]:
    """The answer of `measured` in a new process."""
    environment = os.environ | ({} if cache is None else {"XDG_CACHE_HOME": cache})
    request = json.dumps({"name": name, "sizes": asdict(sizes), "repeats": repeats, "began": time.time()})
    command = [sys.executable, "-c", _APART, request]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def answer(request: str) -> None:
    """Print what `measured` finds, for the process that asked."""
    print(json.dumps(measured(**json.loads(request))), flush=True)


def measured(name: str, sizes: dict[str, int], repeats: int, began: float) -> dict[str, Any]:
    """Seconds of a line in this process, which began at a time.

    `first`: start of the process with its imports, and the stages of the first call, as time goes by on all cores.
    `later`: stages in processor time on one core, of the fastest call. `speed_up`: that of calls on all cores.
    """
    work = LINES[name](Sizes(**sizes))
    start = time.time() - began
    with watched(time.perf_counter) as first:
        work(0)
    found: dict[str, Any] = {"first": {"start": start, **first.seconds}}
    if not repeats:
        return found
    _rest()
    on_all = _calls(work, range(1, repeats + 1))
    with one_core():
        on_one = _calls(work, range(repeats + 1, 2 * repeats + 1))
    _, best = min(on_one, key=lambda call: sum(call[1].seconds.values()))
    # Programs are there by now: what is left is to look for them.
    rest = sum(best.seconds.values()) - best.seconds["tracing"]
    found["later"] = {"tracing": best.seconds["tracing"], "rest": rest}
    return found | {"traced": best.traced, "speed_up": min(on_one, key=_taken)[0] / min(on_all, key=_taken)[0]}


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


def _rest() -> None:
    """Wait until programs that are made beside are there."""
    spent = math.inf
    while spent > 0.1 * _AT_REST:
        before = time.process_time()
        time.sleep(_AT_REST)
        spent = time.process_time() - before
