"""The time that a film would take, from a few frames: those of a large film are drawn in small sizes."""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from kerrcaustics.cli.options import CommonOptions
from kerrcaustics.cli.terminal import plain_errors, progress, say
from kerrcaustics.results.time_left import in_round_words

if TYPE_CHECKING:
    from kerrcaustics.films.film import Film

# Pixels of the frames that are drawn, where the film's own have more than the larger number.
SMALL, LARGE = 20_000, 80_000
# Places in the film, as parts of it.
_PLACES = (1 / 6, 1 / 2, 5 / 6)


def estimate_film(
    size: tuple[int, int],
    film_in: Callable[[tuple[int, int]], "Film"],
    only: range | None,
    workers: int,
    common: CommonOptions,
) -> None:
    """Say how long a film of a size would take, and write nothing of it; film_in: the film in another size."""
    sizes = _sizes(*size)
    times: list[list[float]] = []
    with progress() as report, plain_errors():
        report("frames in small sizes", 0.0)
        films = [film_in(other) for other in sizes]
        numbers = only or range(films[0].frames)
        chosen = [numbers[int(part * len(numbers))] for part in _PLACES]
        for number, film in enumerate(films):
            # The first one loads.
            film.draw(chosen[0])
            times.append([seconds_to_draw(film, frame) for frame in chosen])
            report("frames in small sizes", (number + 1) / len(sizes))
    pixels, count = math.prod(size), len(numbers)
    drawn = [math.prod(each) for each in sizes]
    low, high = (time_of_frame(drawn, [least(each) for each in times], pixels) for least in (min, max))
    seconds = [each * count / workers for each in (low, high)]
    shown = " x ".join(map(str, size))
    where = f" on {workers} processes" if workers > 1 else ""
    small = "" if len(sizes) == 1 else ", from frames of " + " and ".join(f"{w} x {h}" for w, h in sizes)
    out = common.console()
    say(out, f"A frame of {shown} pixels: {_range_in_words(low, high)}{small}")
    say(out, f"{count} frames{where}: {_range_in_words(*seconds)}")
    common.write(
        {
            "schema": "kerrcaustics/film-estimate/1",
            "frames": count,
            "processes": workers,
            "size": list(size),
            "drawn_sizes": [list(each) for each in sizes],
            "seconds_per_frame": [low, high],
            "seconds": seconds,
        }
    )


def _sizes(width: int, height: int) -> list[tuple[int, int]]:
    """The sizes of frames that are drawn: that of the film, or two smaller ones of even lengths."""
    if width * height <= LARGE:
        return [(width, height)]
    parts = [math.sqrt(pixels / (width * height)) for pixels in (SMALL, LARGE)]
    return [(2 * max(1, round(part * width / 2)), 2 * max(1, round(part * height / 2))) for part in parts]


def time_of_frame(pixels: list[int], seconds: list[float], wanted: int) -> float:
    """The time of a frame of so many pixels: a part for each frame, and one for each pixel; of one size its own.

    Noise may make the smaller frame slower: then all of the time is one of pixels.
    """
    if len(pixels) == 1:
        return seconds[0]
    slope = (seconds[1] - seconds[0]) / (pixels[1] - pixels[0])
    if not 0 < slope <= seconds[1] / pixels[1]:
        slope = seconds[1] / pixels[1]
    return seconds[1] + slope * (wanted - pixels[1])


def seconds_to_draw(film: "Film", frame: int) -> float:
    """The time that a frame takes, seconds."""
    began = time.perf_counter()
    film.draw(frame)
    return time.perf_counter() - began


def _range_in_words(low: float, high: float) -> str:
    """Two durations in words; one if they read the same."""
    words = in_round_words(low), in_round_words(high)
    return f"about {words[0]}" if words[0] == words[1] else f"{words[0]} to {words[1]}"
