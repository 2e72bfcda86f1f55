"""The command `render`."""

import math
import os
from pathlib import Path
from time import perf_counter as clock
from typing import TYPE_CHECKING, Annotated, Any

import cyclopts

from kerrcaustics.choices import Quality
from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput
from kerrcaustics.cli.options import COMMON, CommonOptions, FileName, Flag, WholeNumber
from kerrcaustics.cli.outputs import check_picture
from kerrcaustics.cli.sizes import AS_IT_IS, SizeOptions
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import one_line_errors, place_of, progress, say, say_all
from kerrcaustics.results.stages import in_words, stage, stages_timed

if TYPE_CHECKING:
    from kerrcaustics.scene_files.exposure import Development
    from kerrcaustics.scene_files.scene_file import SceneFile
    from kerrcaustics.scenes.rendering import Rendering

# Pixels across a preview; stages that a picture has, at most.
_PREVIEW, _STAGES = 320, 9
# A picture of which more is clipped at white has lost what was there.
_MUCH = 0.02
LEFT_OUT = {
    "disk_map": "no [disk]",
    "disk_light": "no [disk]",
    "sky_map": "no [sky]",
    "shadow_edge": "no [sky]",
    "sky_light": "no [sky]",
    "picture_of_the_sky": "another sky.kind",
    "stars": 'another sky.kind than "stars"',
    "volume": "no [volume], no [spots]",
    "developing": "light.flare = [], no [overlays]",
}
"""What leaves each stage out of a scene."""


@app.command(
    **with_examples("render scene.toml --preview", "render scene.toml --set camera.radius=5 --output near.png")
)
def render(
    scene: FileName,
    /,
    *,
    output: FileName | None = None,
    frame: WholeNumber = 0,
    quality: Quality | None = None,
    preview: Flag = False,
    explain: Flag = False,
    resizing: SizeOptions = AS_IT_IS,
    overrides: Annotated[list[str] | None, cyclopts.Parameter(name="--set", negative=())] = None,
    common: CommonOptions = COMMON,
) -> None:
    """Render a scene file: hole, camera, sky, disk and light as one picture, or one frame of a film.

    Parameters
    ----------
    scene
        The scene, a TOML file: see docs/scene_files.md; `kerrcaustics scene --template disk` prints one.
    output
        Picture file: .png, .jpg, or .exr with linear light, and with alpha if there is no sky; by default in the
        current folder, named after the scene.
    frame
        Number of the frame, counted from 0.
    quality
        Quality of the picture; by default that of the scene.
    preview
        Render a small draft, 320 pixels wide; an automatic exposure is by this frame alone.
    explain
        Print the share of each stage in the time, and what leaves it out of the scene.
    overrides
        Override an entry of the file, for example --set camera.radius=5; may be repeated.
    """
    path = output or Path(f"{scene.stem}.png")
    _check_options(scene, path, preview, resizing)
    common.check({"--output": path})
    began = clock()
    with progress() as report:
        with one_line_errors():
            from kerrcaustics.toml_files import read_toml

            # A file that cannot be read is refused before the engines are loaded.
            read_toml(scene)
            from kerrcaustics.scene_files.scene_file import SceneFile

            file = resizing.applied(SceneFile.read(scene, overrides or []))
        if not 0 <= frame < file.frames:
            raise BadInput(f"Argument --frame must be a whole number from 0 to {file.frames - 1}, but is {frame}.")
        level = quality or ("draft" if preview else file.quality)
        with stages_timed(lambda name, seconds: report(_now(name, seconds), len(seconds) / _STAGES)) as stages:
            rendering, development = _render(file, frame, level, preview, path)
    remarks = [*file.remarks, *_dark_disk(file, rendering, development)]
    entry = {
        "schema": "kerrcaustics/render/1",
        "scene": str(scene),
        "frame": frame,
        "time": file.moment(frame),
        **_viewer_record(rendering),
        "quality": level,
        "exposure": development and development.exposure,
        "clipped": development and development.clipped,
        "remarks": remarks,
        "beams": rendering.beams,
        "stages": stages,
        "seconds": clock() - began,
        "output": str(path),
    }
    common.write(entry)
    out = common.console()
    say(out, f"{_camera_in_words(rendering)}, t = {entry['time']:z.6g}")
    size = f"{rendering.view.width} x {rendering.view.height} pixels"
    say(out, f"{size}, {rendering.beams} beams, {entry['seconds']:.1f} s")
    out.print(_shares(stages, entry["seconds"]) if explain else in_words(stages), soft_wrap=True, highlight=False)
    say_all(out, _less_in_words(file, level) if explain else [])
    say_all(out, [*_tones_in_words(development, file, alone=preview and file.frames > 1), *remarks])
    say(out, f"Picture: {path}")


def _check_options(scene: Path, path: Path, preview: bool, resizing: SizeOptions) -> None:
    """Refuse options that exclude each other, scenes that are no files, and a picture that cannot be written."""
    from kerrcaustics.scene_files.templates import template_names

    if not os.path.exists(scene) and str(scene) in template_names():
        raise BadInput(
            f"Argument SCENE must name a file, but {scene} is a template: kerrcaustics scene --template {scene} > "
            f"{scene}.toml writes it to one."
        )
    if os.path.isdir(scene):
        raise BadInput(f"Argument SCENE must name a file, but {scene} is a folder.")
    check_picture(path)
    resizing.check()
    if preview and resizing != AS_IT_IS:
        raise BadInput("Argument --preview must be left out if --size or --scale is given.")
    if scene.absolute() == path.absolute():
        raise BadInput(f"Argument --output must name a different file from the scene, but both are {path}.")


def _viewer_record(rendering: "Rendering") -> dict[str, Any]:
    """The viewer and the size of a picture, as JSON holds them."""
    from kerrcaustics.results.records import in_degrees

    viewer = rendering.camera
    return {
        "spin": viewer.spin,
        "radius": viewer.radius if math.isfinite(viewer.radius) else None,
        "inclination_deg": in_degrees(viewer.inclination),
        "velocity": list(viewer.fido_velocity()),
        "size": [rendering.view.width, rendering.view.height],
    }


def _camera_in_words(rendering: "Rendering") -> str:
    """Place and motion: a velocity in three numbers by its size; an observer is one."""
    velocity = rendering.camera.velocity
    words = place_of(rendering.camera)
    if isinstance(velocity, str):
        return words
    return words.replace(f"{velocity} camera", f"a camera at {math.hypot(*velocity or ()):.6g} of the speed of light")


def _tones_in_words(development: "Development | None", scene: "SceneFile", alone: bool) -> list[str]:
    """The exposure, the part of the pixels that are clipped at white, and a hint; nothing for linear light.

    alone: it is that of a film's frame by itself.
    """
    if development is None:
        return []
    exposure, clipped = f"{development.exposure:.6g}", f"{100 * development.clipped:.2g} %"
    chosen = ""
    if scene.contents.light.exposure == "auto":
        chosen = " (auto, by this frame alone)" if alone else " (auto)"
    brighter = f"--set light.exposure={2 * development.exposure:.3g} doubles the exposure"
    if development.clipped > _MUCH:
        brighter = (
            "--set light.exposure=auto sets it from the light"
            if not chosen
            else "light.curve = asinh keeps more detail in bright parts"
        )
    return [f"Exposure {exposure}{chosen}, {clipped} of the pixels are clipped at white; {brighter}"]


def _shares(stages: dict[str, float], total: float) -> PlainTable:
    """The stages, longest first, with their shares of the time, and what leaves each out; last what is none of them."""
    table = PlainTable(("stage", "s", "share", "left out by"), words=("stage", "left out by"))
    rows = sorted(stages.items(), key=lambda one: -one[1])
    for name, seconds in [*rows, ("start, reading, and the rest", max(total - sum(stages.values()), 0.0))]:
        share = f"{100 * seconds / total:.0f} %"
        table.add_row(name.replace("_", " "), f"{seconds:.2f}", share, LEFT_OUT.get(name, ""))
    return table


def _less_in_words(scene: "SceneFile", quality: str) -> list[str]:
    """What leaves out the blur of motion, where a picture has it, and less of everything."""
    film, lines = scene.contents.film, []
    if quality != "draft":
        if film is not None and film.shutter_deg > 0:
            lines.append("Motion while the shutter is open takes several maps: film.shutter_deg = 0 leaves it out")
        lines.append("A draft, --quality draft, is coarser in all of this")
    return lines


def _dark_disk(scene: "SceneFile", rendering: "Rendering", development: "Development | None") -> tuple[str, ...]:
    """A line on a disk that is too dark to be seen; none for linear light."""
    from kerrcaustics.scene_files.exposure import dark_disk

    contents = scene.contents
    if development is None:
        return ()
    return dark_disk(contents.disk, contents.sky, rendering.transmission, development.picture)


def _now(stage: str, before: dict[str, float]) -> str:
    """The stage that is on, and the time of those before it."""
    return f"{stage.replace('_', ' ')} ({in_words(before)})" if before else stage.replace("_", " ")


def _render(
    scene: "SceneFile", frame: int, quality: str, preview: bool, path: Path
) -> "tuple[Rendering, Development | None]":
    """Render a frame and write its picture; how it was developed, unless it is linear light."""
    from kerrcaustics.scenes.picture_files import save_light, save_picture

    scale = min(_PREVIEW / scene.size[0], 1.0) if preview else 1.0
    with one_line_errors(lambda reason: f"The picture {path} cannot be written: {reason}."):
        rendering = scene.rendering(frame, quality=quality, scale=scale)
        with stage("developing"):
            if path.suffix.lower() == ".exr":
                save_light(path, scene.light(rendering, scale), rendering.alpha)
                return rendering, None
            development = scene.development(frame, rendering, scale, alone=preview)
            picture = scene.with_overlays(frame, rendering, development.picture)
        with stage("encoding"):
            save_picture(path, picture, f"exposure {development.exposure:.6g}")
        return rendering, development
