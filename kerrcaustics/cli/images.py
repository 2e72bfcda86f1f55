"""The command `images`: the images of a star."""

import time
from typing import TYPE_CHECKING

from rich.console import Console

from kerrcaustics.cli.app import app, stop, with_examples
from kerrcaustics.cli.options import COMMON, SKY_SOURCES, Angles, CameraOptions, CommonOptions, MaxIndex, SourceOptions
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
        "images --spin 0.999 --radius 2.6 --star 90 141",
        "images --spin 0.9 --radius 1000 --inclination 80 --plane 1 --star 6 45",
    )
)
def images(
    *,
    camera: CameraOptions,
    star: Angles,
    max_index: MaxIndex = 2,
    source: SourceOptions = SKY_SOURCES,
    common: CommonOptions = COMMON,
) -> None:
    """Find all images of a star up to a Morse index, with a certificate that none is missing.

    Parameters
    ----------
    star
        The star's place on its sphere: theta' from the spin axis and phi', degrees; with --plane: r and phi.
    """
    common.check()
    end, place, seen_from = source.end(), source.place("--star", star), camera.viewer()
    began = time.perf_counter()
    with plain_errors(), progress() as report:
        from kerrcaustics.images.images import star_images
        from kerrcaustics.results.records import record

        result = star_images(seen_from, place, max_index, end=end, progress=report)
    common.write_result(record(result), time.perf_counter() - began)
    _print_images(result, common.console())
    if not result.certified:
        stop(1, "The images are not certified: see the remarks.")


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
