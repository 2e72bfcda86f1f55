"""The command `film`."""

import os
import re
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kerrcaustics.choices import Quality, suggestion
from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.options import COMMON, HERE, CommonOptions, FileName, Flag, WorkerOptions
from kerrcaustics.cli.outputs import check_film
from kerrcaustics.cli.script_names import script_names
from kerrcaustics.cli.sizes import AS_IT_IS, SizeOptions
from kerrcaustics.cli.terminal import console, note, one_line_errors, plain_errors, progress, say
from kerrcaustics.interrupts import NOTHING_LEFT, on_interrupt
from kerrcaustics.results.stages import in_words

if TYPE_CHECKING:
    from kerrcaustics.films.film import Film, FilmResult
    from kerrcaustics.films.scene_films import FilmedScene


@app.command(**with_examples("film scene.toml --quality draft --frames 0:10", "film star_field --output stars.mp4"))
def film(
    name: str,
    /,
    *,
    output: FileName | None = None,
    frames: str | None = None,
    quality: Quality | None = None,
    resizing: SizeOptions = AS_IT_IS,
    workers: WorkerOptions = HERE,
    restart: Flag = False,
    estimate: Flag = False,
    common: CommonOptions = COMMON,
) -> None:
    """Make a film from a scene file, a template, or a script (in the folder figures/films/ of a checkout).

    A film takes minutes; an estimate of the time is shown once each process has drawn two frames. An interrupted film
    resumes when it is started again.

    Parameters
    ----------
    name
        The scene, a TOML file; or the name of a template (kerrcaustics scene lists them) or of a script.
    output
        Film file, .mp4 (H.264) or .gif; by default an .mp4 file in the current folder, named after the scene or script.
    frames
        A:B for a clip of frames A to B - 1 only; for a script, the number of frames, 2 or more.
    quality
        Quality of the pictures of a scene: draft, normal or high; by default that of the scene.
    restart
        Discard the existing frames and draw all of them again.
    estimate
        Of a scene: say how long the film would take, from a few frames in small sizes, and write nothing.
    """
    workers.check()
    count, only = _frames(frames)
    if estimate:
        unused = {"--output": output, "--restart": restart or None, "--scheduler": workers.scheduler}
        for option in (option for option, value in unused.items() if value is not None):
            raise BadInput(f"Argument {option} must not be used with --estimate.")
        common.check()
        resizing.check(even=True)
        _check_name(name, count, quality, resizing)
        if (scene := _scene_of(name)) is None:
            raise BadInput(f"Argument --estimate must be used with a scene (.toml), but {name} is a script.")
        from kerrcaustics.cli.film_estimate import estimate_film

        def film_in(size: tuple[int, int]) -> "Film":
            return film_of_scene_file(scene, quality, SizeOptions(size="x".join(map(str, size))), only)

        estimate_film(filmed_scene(scene, resizing).size, film_in, only, workers.workers or 1, common)
        return
    path = output or Path(f"{Path(name).stem}.mp4")
    check_film(path, "--output")
    common.check({"--output": path})
    resizing.check(even=True)
    _check_name(name, count, quality, resizing)
    workers.announce()
    with progress(left=True, at_once=workers.workers or 1) as report:
        scene = _scene_of(name)
        if scene is None:
            film = _script_film(name, count, workers != HERE)
        else:
            film = film_of_scene_file(scene, quality, resizing, only)
        result = _make(path, film, report, frames=only, restart=restart, **asdict(workers))
    _report(result, common)


def write_film(path: Path, film: "Callable[[], Film]", restart: bool) -> None:
    """Make a film beside other output of a command."""
    with progress(left=True) as report:
        result = _make(path, film(), report, restart=restart)
    if result.output is None:
        stop(1, result.complaint)


def _make(path: Path, film: "Film", report: Any, **options: Any) -> "FilmResult":
    """Make a film; every error is one line."""
    from kerrcaustics.films.film import frames_folder, make_film

    def announce(line: str, _left: float) -> None:
        say(console(stderr=True), line)

    folder = frames_folder(path)
    on_interrupt(lambda: frames_left_in(folder))
    kept = f"The frames drawn so far are kept in {folder}; start again to resume."
    with one_line_errors(lambda reason: f"The film {path} cannot be written: {reason}. {kept}"), plain_errors():
        return make_film(path, film, progress=report, announce=announce, **options)


def frames_left_in(folder: Path) -> str:
    """The frames that an interrupted film leaves behind, in words."""
    from kerrcaustics.films.frame_store import discard, frames_in

    count = len(frames_in(folder))
    if not count:
        discard(folder)
        return NOTHING_LEFT
    frames = "1 frame is" if count == 1 else f"{count} frames are"
    return f"{frames} kept in {folder}; start again to resume."


def _report(result: "FilmResult", common: CommonOptions) -> None:
    from kerrcaustics.films.frame_store import frames_in
    from kerrcaustics.results.records import record

    common.write(record(result))
    if result.output is None:
        stop(1, result.complaint)
    out = common.console()
    say(out, f"{result.frames} frames: {result.reused} drawn before, {result.drawn} now; {result.seconds:.1f} s")
    say(out, in_words(result.stages))
    say(out, f"Film: {result.output}")
    if frames_in(result.folder):
        say(out, f"Its frames are kept for the whole film in {result.folder}")


def _scene_of(name: str) -> Path | None:
    """The scene file that a name means; None for the name of a script."""
    if Path(name).suffix.lower() == ".toml":
        return Path(name)
    from kerrcaustics.scene_files.templates import film_templates, template_path

    return template_path(name) if name in film_templates() else None


def _frames(frames: str | None) -> tuple[int | None, range | None]:
    """The number of frames, or a range of them."""
    if frames is None:
        return None, None
    clip = re.fullmatch(r"(\d+):(\d+)", frames)
    if clip and int(clip[1]) < int(clip[2]):
        return None, range(int(clip[1]), int(clip[2]))
    if clip or not re.fullmatch(r"-?\d+", frames):
        raise BadInput(f"Argument --frames must be A:B with A less than B, or a whole number, but is {frames}.")
    if int(frames) < 2:
        raise BadInput(f"Argument --frames must be 2 or more, but is {frames}.")
    return int(frames), None


def _check_name(name: str, count: int | None, quality: Quality | None, resizing: SizeOptions) -> None:
    """Refuse scenes and scripts that are not there, and what is given for the other kind."""
    scene = _scene_of(name)
    if scene is not None:
        if not os.path.isfile(scene):
            raise BadInput(f"Argument NAME must be a scene file or the name of a film, but there is no file {name}.")
        if count is not None:
            raise BadInput(f"Argument --frames must be A:B for a scene, which sets the number itself, but is {count}.")
        return
    from kerrcaustics.scene_files.templates import film_templates
    from kerrcaustics.scripts import FILMS

    names = sorted([*script_names(FILMS, "Films"), *film_templates()])
    if name not in names:
        raise BadInput(
            f"Argument NAME must be one of {', '.join(names)}, or a scene (.toml), but is {name}"
            f"{suggestion(name, names)}"
        )
    for option, value in {"--quality": quality, "--size": resizing.size, "--scale": resizing.scale}.items():
        if value is not None:
            raise BadInput(f"Argument {option} must be used with a scene (.toml), but {name} is a script.")


def film_of_scene_file(path: Path, quality: Quality | None, resizing: SizeOptions, only: range | None = None) -> "Film":
    """The film that a scene file describes; only: the frames that are drawn of it."""
    from kerrcaustics.films.scene_films import scene_film

    scene = filmed_scene(path, resizing)
    with one_line_errors():
        # Before its exposures are computed, for which frames are drawn.
        drawn = scene_film(scene, quality)
        if only is not None and only.stop > drawn.frames:
            clip = f"{only.start}:{only.stop}"
            raise BadInput(f"Argument --frames must lie within 0:{drawn.frames}, which are all, but is {clip}.")
        return scene_film(scene.with_exposures(), quality)


def filmed_scene(path: Path, resizing: SizeOptions) -> "FilmedScene":
    """The scene of a film, in its size."""
    from kerrcaustics.films.scene_films import FilmedScene

    with one_line_errors():
        from kerrcaustics.sweeps.reading import read_scene

        scene = read_scene(path)
        if not isinstance(scene, FilmedScene):
            raise BadInput(f"Argument NAME must be the scene of a picture or a film, but {path} is a sweep file.")
        # Scenes of other classes are films.
        if not getattr(scene, "is_film", True):
            raise BadInput(
                f"Scene {path} has no table [film], and so one frame: add one with frames or duration, or use "
                "kerrcaustics render."
            )
        for line in scene.remarks:
            note(line)
        return resizing.applied(scene, even=True)


def _script_film(name: str, count: int | None, elsewhere: bool) -> "Film":
    """The film of a script; elsewhere: other processes draw it."""
    from kerrcaustics.scripts import FILMS, ScriptFrames, script_film

    film = script_film(FILMS, name, count)
    return replace(film, draw=ScriptFrames(FILMS, name, count)) if elsewhere else film
