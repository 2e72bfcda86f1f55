"""The command `images`: the images of a star."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import stop
from kerrcaustics.cli.options import (
    COMMON,
    SKY_SOURCES,
    Angles,
    CameraOptions,
    CommonOptions,
    FileName,
    MaxIndex,
    SourceOptions,
)
from kerrcaustics.cli.outputs import check_ending, write_figure
from kerrcaustics.cli.tables import rows_of, table_of
from kerrcaustics.cli.terminal import (
    index_counts,
    place_heads,
    place_in_words,
    place_of,
    plain_errors,
    progress,
    say,
    say_all,
    verdict,
)

if TYPE_CHECKING:
    from kerrcaustics.images.images import StarImages


@app.command(
    **with_examples(
        "images --spin 0.999 --radius 2.6 --star 90 141 --figure images.png",
        "images --spin 0.9 --radius 1000 --inclination 80 --plane 1 --star 6 45",
    )
)
def images(
    *,
    camera: CameraOptions,
    star: Angles,
    max_index: MaxIndex = 2,
    figure: FileName | None = None,
    source: SourceOptions = SKY_SOURCES,
    common: CommonOptions = COMMON,
) -> None:
    """Find all images of a star up to a Morse index, with a certificate that none is missing.

    Parameters
    ----------
    star
        The star's place on its sphere: theta' from the spin axis and phi', degrees; with --plane: r and phi.
    figure
        Save a plot of the images among the critical curves, and the star among the caustics, to this file: .png, .pdf
        or .svg.
    """
    common.check({"--figure": figure})
    check_ending(figure)
    end, place, viewer = source.end(), source.place("--star", star), camera.viewer()
    began = time.perf_counter()
    with plain_errors(), progress() as report:
        from kerrcaustics.images.images import star_images
        from kerrcaustics.results.records import record

        result = star_images(viewer, place, max_index, end=end, progress=report)
        seconds = time.perf_counter() - began
        if figure is not None:
            report("drawing", 1.0)
            _draw(result, figure)
    common.write_result(record(result), seconds)
    _print_images(result, common.console())
    common.say_files(figure=figure)
    if not result.certified:
        stop(1, "The images are not certified: see the remarks.")


def _draw(images: "StarImages", path: Path) -> None:
    from kerrcaustics.curves.caustic_search import caustics
    from kerrcaustics.draw.image_figure import images_figure

    write_figure(images_figure(images, caustics(images.camera, images.max_index + 1, end=images.surface)), path)


def _print_images(images: "StarImages", out: Console) -> None:
    surface, camera = images.surface, images.camera
    place = place_in_words(surface, images.star)
    say(out, f"{place_of(camera)}: images of the source at {place} on {surface.in_words()}")
    columns = {
        "index": "index",
        "parity": lambda image: "+" if image.parity > 0 else "-",
        camera.sky_coordinates: "sky:+z.5f",
        place_heads(surface)[1]: "azimuth:z.3f",
        "magnifi\N{SOFT HYPHEN}cation": "magnification:.4g",
        "cross\N{SOFT HYPHEN}ings": "crossings",
        "redshift": "redshift:.5f",
        "error": "error:.0e",
        "time": "time:z.6f",
    }
    out.print(table_of(rows_of(images), columns))
    say_all(out, images.remarks)
    say(out, f"{index_counts(images.per_index)}: {verdict(images.certified)}; errors on the sky in {camera.sky_unit}")
