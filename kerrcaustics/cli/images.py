"""The command `images`: the images of a star."""

import math
import time
from typing import TYPE_CHECKING

from rich.console import Console

from kerrcaustics.cli.app import app, stop, with_examples
from kerrcaustics.cli.options import (
    COMMON,
    SKY_SOURCES,
    Angles,
    CameraOptions,
    CommonOptions,
    MaxIndex,
    SourceOptions,
)
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import (
    counted,
    place_heads,
    place_in_words,
    place_of,
    plain_errors,
    progress,
    say,
    sure,
)

if TYPE_CHECKING:
    from kerrcaustics.stars.images import StarImages


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
    """Find all images of a star up to a Morse index, and say whether none is missing.

    Parameters
    ----------
    star
        The star's place on its sphere: theta' from the spin axis and phi', degrees; with --plane: r and phi.
    """
    common.check()
    end = source.end()
    place = source.place("--star", star)
    seen_from = camera.viewer()
    began = time.perf_counter()
    with plain_errors(), progress():
        from kerrcaustics.results.records import record
        from kerrcaustics.stars.images import star_images

        found = star_images(seen_from, place, max_index, end=end)
    common.write_found(record(found), time.perf_counter() - began)
    _print_images(found, common.console())
    if not found.certified:
        stop(1, "The images are not certified: see the remarks.")


def _print_images(found: "StarImages", out: Console) -> None:
    surface, camera = found.surface, found.camera
    place = place_in_words(surface, found.star)
    say(out, f"{place_of(camera)}: images of the source at {place} on {surface.in_words()}")
    table = PlainTable(
        (
            "index",
            "parity",
            camera.sky_coordinates,
            place_heads(surface)[1],
            "magnifi\N{SOFT HYPHEN}cation",
            "cross\N{SOFT HYPHEN}ings",
            "redshift",
            "error",
            "time",
        )
    )
    for i in range(len(found)):
        table.add_row(
            str(found.index[i]),
            "+" if found.parity[i] > 0 else "-",
            " ".join(f"{x:+z.5f}" for x in found.sky[i]),
            f"{math.degrees(found.azimuth[i]):z.3f}",
            f"{found.magnification[i]:.4g}",
            str(found.crossings[i]),
            f"{found.redshift[i]:.5f}",
            f"{found.error[i]:.0e}",
            f"{found.time[i]:z.6f}",
        )
    out.print(table)
    for remark in found.remarks:
        say(out, remark)
    say(out, f"{counted(found.per_index)}: {sure(found.certified)}; errors on the sky in {camera.sky_unit}")
