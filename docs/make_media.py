"""Short films of the pages, and pictures of the front page: `python docs/make_media.py [NAME ...]` makes them anew.

A film, docs/clips/NAME.mp4, is one of `kerrcaustics film`, with fewer and smaller frames, so that the repository can
hold it; a picture is docs/images/NAME.png, and a film that a page shows as a picture, NAME.webp. Each goes into
docs/media.json with its digests (media_digests.py).
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory

import av
import matplotlib.pyplot as plt
import numpy as np
from media_digests import code_before, record
from PIL import Image

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.scene_files.templates import template_path
from kerrcaustics.scripts import FIGURES, FILMS

CLIP_FOLDER, IMAGE_FOLDER = Path(__file__).parent / "clips", Path(__file__).parent / "images"
CARD = (960, 540)
"""Width and height of a picture of the front page."""

Draw = Callable[[int], np.ndarray]


@dataclass(frozen=True)
class Clip:
    """So many frames of a whole film, `width` pixels wide; a larger `crf` makes a smaller file."""

    frames: int
    width: int
    crf: int
    rate: int = 12


CLIPS = {
    "pair_creation": Clip(120, 960, 30),
    "descent": Clip(96, 960, 30),
    "finite_star": Clip(120, 960, 30),
    "mapping": Clip(96, 960, 30),
    "star_field": Clip(60, 640, 35),
    "galactic_plane": Clip(120, 960, 32),
}


def drawn_by(name: str, clip: Clip) -> Draw:
    """The function that draws the frames of a script, or of a template at the clip's size."""
    if name in FILMS.names():
        return FILMS.load(name).film(clip.frames).draw
    scene = kc.SceneFile.read(template_path(name))
    step, scale = scene.frames / clip.frames, clip.width / scene.size[0]
    return lambda number: scene.picture(round(number * step), scale=scale)


def frames(name: str, clip: Clip) -> Iterator[np.ndarray]:
    """Pictures (height, width, 3) of the clip's size."""
    draw = drawn_by(name, clip)
    for number in range(clip.frames):
        picture = Image.fromarray(draw(number))
        yield np.asarray(picture.resize((clip.width, clip.width * 9 // 16), Image.Resampling.LANCZOS))
        print(f"\r{name}: {number + 1} of {clip.frames}", end="", flush=True)


def make_clip(name: str) -> None:
    """Write the clip of a name."""
    clip = CLIPS[name]
    with av.open(str(CLIP_FOLDER / f"{name}.mp4"), "w", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=Fraction(clip.rate))
        stream.width, stream.height, stream.pix_fmt = clip.width, clip.width * 9 // 16, "yuv420p"
        stream.options = {"crf": str(clip.crf), "preset": "veryslow", "threads": "1"}
        for picture in frames(name, clip):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    print()


def scene_of_page(picture: str) -> kc.SceneFile:
    """The scene file that docs/scene_files.md shows before a picture."""
    page = (Path(__file__).parent / "scene_files.md").read_text(encoding="utf-8")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(code_before(page, picture), encoding="utf-8")
        return kc.SceneFile.read(path)


def make_loop(name: str) -> None:
    """Write the film of a scene whose second half is the first one backward, as an animated picture."""
    scene = scene_of_page(f"{name}.webp")
    half = []
    for number in range(scene.frames // 2 + 1):
        half.append(Image.fromarray(scene.picture(number)))
        print(f"\r{name}: {number + 1} of {scene.frames // 2 + 1}", end="", flush=True)
    print()
    save_loop(name, [*half, *half[-2:0:-1]], scene.rate)


def save_loop(name: str, pictures: list[Image.Image], rate: int) -> None:
    """Write an animated picture that plays for ever, so many pictures a second."""
    options = {"duration": round(1000 / rate), "loop": 0, "quality": 82, "method": 6}
    pictures[0].save(IMAGE_FOLDER / f"{name}.webp", save_all=True, append_images=pictures[1:], **options)


def scene_file() -> Image.Image:
    """The picture of the first scene file of docs/scene_files.md."""
    return Image.fromarray(scene_of_page("scene_file.png").picture(0))


def front_caustics() -> Image.Image:
    """Critical curves on the camera sky beside the secondary caustic."""
    caustics = kc.caustics(kc.Camera(spin=0.999, radius=6.03), orders=3)
    with plt.rc_context(style.RC):
        figure, (sky, sphere) = plt.subplots(1, 2, figsize=(4.8, 2.7), dpi=200, layout="constrained")
        caustics.plot(sky, sky="camera").set_title("critical curves on the camera sky")
        sky.get_legend().remove()
        caustics[1].plot(sphere).set_title("the secondary caustic")
        figure.canvas.draw()
        return Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3]).quantize(128)


def front_tubes() -> Image.Image:
    """The figure of caustic tubes without its texts, transparent where it is white."""
    with TemporaryDirectory() as folder:
        *_, path = FIGURES.run("space_caustic_tubes", Path(folder))
        picture = Image.open(path).convert("RGB").crop((0, 120, 1600, 1020)).resize(CARD, Image.Resampling.LANCZOS)
    light = np.asarray(picture) / 255
    opacity = 1 - light.min(axis=2, keepdims=True)
    colour = np.where(opacity > 0, 1 - (1 - light) / np.maximum(opacity, 1e-3), 0)
    return Image.fromarray((np.concatenate([colour, opacity], axis=2) * 255).round().astype(np.uint8))


PICTURES = {"front_caustics": front_caustics, "front_tubes": front_tubes, "scene_file": scene_file}
LOOPS = ("scene_film",)


def make(name: str) -> None:
    """Write the clip or the picture of a name."""
    if name in PICTURES:
        PICTURES[name]().save(IMAGE_FOLDER / f"{name}.png", optimize=True)
    elif name in LOOPS:
        make_loop(name)
    else:
        make_clip(name)
    record([name])


if __name__ == "__main__":
    for chosen in sys.argv[1:] or [*CLIPS, *PICTURES, *LOOPS]:
        make(chosen)
