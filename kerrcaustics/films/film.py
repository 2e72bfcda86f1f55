"""Films: frames kept until the film is complete, then written as MP4 (H.264) or GIF.

An interrupted film resumes: each frame is a file of its own beside the film until then.
"""

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Any

from kerrcaustics.files import remove_abandoned
from kerrcaustics.films import frame_store
from kerrcaustics.films.frame_store import Draw, FrameStore
from kerrcaustics.films.video import check_film_path, write_pictures
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.results.progress import Progress, listening, report, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.results.stages import stage, with_stages
from kerrcaustics.results.time_left import in_round_words
from kerrcaustics.workers.places import Run, check_answer, check_place, place
from kerrcaustics.workers.worker_failures import Compute, Finished, WorkerFailures

# A film that is done in fewer seconds needs no estimate, and one with fewer frames to draw has them in their order.
_WORTH_SAYING, _SPREAD_FROM = 10.0, 24
# Frames of each process after its first, after which their time is announced, and checked: one of them may load too.
_ANNOUNCED_AFTER, _MOST_OFF = (1, 4), 1 / 3
# Frames that failed, besides the first, that are named in a line.
_MOST_NAMED = 10
_STAGES = "seconds of frames and encoding, by these names; those of its pictures too if one process draws"
_DIED = "the process that drew it died each time (too little memory?)"


@dataclass(frozen=True)
class Film:
    """A film that can be drawn frame by frame, in any order.

    Attributes
    ----------
    name : str
        Its subject, in a word.
    settings : dict
        All that its frames depend on (numbers and strings): a film resumes only from frames of equal settings.
    frames : int
        Number of frames.
    rate : int
        Frames per second.
    draw : callable
        Frame number, from 0, to a picture (height, width, 3) of bytes; both lengths even. For workers one that can be
        pickled.
    """

    name: str
    settings: dict[str, Any]
    frames: int
    rate: int
    draw: Draw


@result("film/1", record="frames drawn reused failed failures seconds stages output")
class FilmResult(Shown):
    """Counts, failures and times of the making of a film."""

    output: Path | None = quantity("", "", "the film; None where frames failed, and there is none yet")
    folder: Path = quantity("", "", "its frames, until it is complete")
    frames: int = quantity("", "1", "frames of the film, or of the clip")
    drawn: int = quantity("", "1", "frames drawn now")
    reused: int = quantity("", "1", "frames that were there at the start")
    failures: tuple[str, ...] = quantity("", "", "a line for each frame that failed, with its number and why")
    seconds: float = quantity("", "s", "time it took")
    stages: dict[str, float] = quantity("", "s", _STAGES, default=dict)

    @property
    @derived("", "1")
    def failed(self) -> int:
        """Number of frames that failed."""
        return len(self.failures)

    @property
    def complaint(self) -> str:
        """A line with the frames that failed, and how to resume."""
        names = [failure.split(":")[0] for failure in self.failures[1:]]
        more = f" So did {', '.join(names[:_MOST_NAMED])}{', ...' if names[_MOST_NAMED:] else ''}." if names else ""
        rest = f"The other {self.drawn + self.reused} are kept in {self.folder}; start again to resume."
        return f"{self.failed} of {self.frames} frames failed: {self.failures[0]}.{more} {rest}"


class FramesFailed(RuntimeError):
    """Frames of a film could not be drawn; the others are kept."""


def write_film(path: str | Path, film: Film, *, progress: Progress | bool | None = None, restart: bool = False) -> Path:
    """Draw the frames that are not there yet, write the film and return its path.

    Parameters and notes as for `make_film`.

    Raises
    ------
    FramesFailed
        Frames could not be drawn; the others were, and are kept.
    """
    film_result = make_film(path, film, progress=progress, restart=restart)
    if film_result.output is None:
        raise FramesFailed(film_result.complaint)
    return film_result.output


@with_progress
@with_stages
def make_film(
    path: str | Path,
    film: Film,
    *,
    frames: range | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    restart: bool = False,
    progress: Progress | bool | None = None,
    announce: Progress = lambda _line, _seconds: None,
) -> FilmResult:
    """Draw the frames that are not there yet, and write the film where all could be drawn.

    Frames are drawn in an order that soon has some from everywhere in the film, so that the time of those that are
    done is an estimate of that of the others. An interrupted film resumes when it is started again; it ends up the same
    to the byte, whichever processes draw its frames. Errors of the disk end it, and leave the frames that are there.

    Parameters
    ----------
    path : str or path
        Ends in .mp4 (H.264, yuv420p: plays everywhere) or .gif (256 colours a frame, plays for ever).
    film : Film
    frames : range
        A clip: these frames alone.
    workers : int
        So many processes of this machine, of one core each; None, this process.
    scheduler : str
        Instead: address of a Dask scheduler whose workers see the same file system, such as "tcp://host:8786".
    restart : bool
        Frames that are there already are thrown away.
    progress : callable or bool, optional
        As for `caustics`; the part is that of the frames that are done.
    announce : callable
        Called with a line on how long a frame and the film take, and the seconds left, when each process has drawn the
        frame with which it loads, and another; the second frame is from the middle of the film. Called
        once more if three frames later that was off by more than a third; not for films of a few seconds.

    Returns
    -------
    FilmResult
        With a line for each frame that failed. A failure costs no other frame; the next call tries it again.

    Raises
    ------
    kerrcaustics.workers.worker_failures.WorkersLost
        Workers died again and again, or there were none. The frames that were drawn are kept.

    Notes
    -----
    Frames wait in a hidden folder beside the film, which goes when the whole film is complete. It may be a link to
    another folder; then both stay, without the frames. Frames of a film with other settings raise a ValueError that
    names the differences.
    """
    path, began = Path(path), time.perf_counter()
    check_place(workers, scheduler)
    check_film_path(path)
    numbers = range(film.frames) if frames is None else frames
    if not numbers or min(numbers) < 0 or max(numbers) >= film.frames:
        clip = f"{numbers.start}:{numbers.stop}"
        raise ValueError(f"Argument `frames` must lie within 0:{film.frames}, which are all, but is {clip}.")
    check_answer(scheduler)
    folder = frames_folder(path)
    with frame_store.store_lock(folder):
        store = frame_store.open_frames(folder, frame_store.film_record(film.name, film.frames, film.settings), restart)
        remove_abandoned(path.resolve().parent, path.resolve().name)
        missing = [number for number in numbers if not store.has(number)]
        reused = len(numbers) - len(missing)
        store.make_room(missing)
        draw = frame_store.draw_frame if scheduler is None else frame_store.draw_frame_again
        job = partial(draw, str(folder.absolute()), store.mark, film.draw)
        # The time left goes by the first part that is reported, and stages report too.
        report(f"{reused} of {len(numbers)} frames", reused / len(numbers))
        with stage("frames"):
            drawn_one = _announcing(announce, store, len(missing), workers)
            _draw(store, job, _spread(missing), len(numbers), place(workers, scheduler, _one_by_one), drawn_one)
        reasons = {number: store.failure(number) for number in missing}
        failures = tuple(f"frame {number}: {reason}" for number, reason in reasons.items() if reason)
        if not failures:
            report("writing the film", 1.0)
            with stage("encoding"):
                write_pictures(path, map(store.read, numbers), film.rate)
            if len(numbers) == film.frames:
                frame_store.discard(folder)
    drawn, output = len(missing) - len(failures), None if failures else path
    return FilmResult(output, folder, len(numbers), drawn, reused, failures, time.perf_counter() - began)


def _draw(
    store: FrameStore, job: Compute, missing: list[int], total: int, run: Run, drawn_one: Callable[[int], None]
) -> None:
    """Draw the missing frames of so many; store the reason for each that cannot be drawn."""
    done = total - len(missing)

    def tell(more: str = "") -> None:
        report(f"{done} of {total} frames{more}", done / total)

    tell()
    if not missing:
        return
    worker_failures = WorkerFailures(lambda what: tell(f", {what}"), "film")
    with closing(run(job, missing, worker_failures)) as finished:
        for number, drawn in finished:
            if not drawn:
                store.fail(number, _DIED)
            done += 1
            tell()
            drawn_one(number)


def _spread(numbers: list[int]) -> list[int]:
    """Frames in an order in which the first so many are from everywhere: by their places with the bits reversed."""
    if len(numbers) < _SPREAD_FROM:
        return numbers
    bits = len(numbers).bit_length()
    return [numbers[place] for place in sorted(range(len(numbers)), key=lambda place: f"{place:0{bits}b}"[::-1])]


def _announcing(announce: Progress, store: FrameStore, missing: int, workers: int | None) -> Callable[[int], None]:
    """Take the frames as they are drawn; announce the time of one and of all, and mend it once if it was far off."""
    times: list[float] = []
    announced, drawn = [], 0

    def drawn_one(number: int) -> None:
        nonlocal drawn
        drawn += 1
        took = store.seconds(number)
        times.extend([] if took is None else [took])
        # Of a cluster the processes are known by their first frames.
        processes = workers or max(drawn - len(times), 1)
        if took is None or len(times) not in [processes * each for each in _ANNOUNCED_AFTER]:
            return
        frame = _without_longest(times)
        left = frame * (missing - drawn) / processes
        if left >= _WORTH_SAYING and not (announced and abs(announced[-1] / frame - 1) < _MOST_OFF):
            announced.append(frame)
            announce(_time_in_words(frame, missing, processes), left)

    return drawn_one


def _without_longest(times: list[float]) -> float:
    """The mean without the longest quarter, which may have loaded."""
    return fmean(sorted(times)[: len(times) - len(times) // 4])


def _time_in_words(frame: float, missing: int, processes: int) -> str:
    """The time for a frame, and for all that are missing."""
    where = f" on {processes} processes" if processes > 1 else ""
    return (
        f"About {in_round_words(frame)} a frame; {missing} frames{where}: {in_round_words(frame * missing / processes)}"
    )


def _one_by_one(compute: Compute, numbers: list[int], _worker_failures: WorkerFailures) -> Finished:
    for number in numbers:
        with listening(False):
            compute(number)
        yield number, True


def frames_folder(path: Path) -> Path:
    """Return the folder of the frames of an unfinished film."""
    return path.with_name(f".{path.name}.frames")
