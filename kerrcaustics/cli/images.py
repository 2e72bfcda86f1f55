"""The command `images`: the images of a star."""

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import stop
from kerrcaustics.cli.options import (
    COMMON,
    SKY_SOURCES,
    UNITS_OF_MASS,
    Angles,
    CameraOptions,
    CommonOptions,
    FileName,
    MaxIndex,
    ScaleOptions,
    SourceOptions,
)
from kerrcaustics.cli.outputs import check_ending, write_figure
from kerrcaustics.cli.tables import rows_of, table_of
from kerrcaustics.cli.terminal import (
    has_ratio,
    index_counts,
    magnification_head,
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
    from kerrcaustics.interop.physical_scale import PhysicalScale


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
    save: FileName | None = None,
    source: SourceOptions = SKY_SOURCES,
    scaling: ScaleOptions = UNITS_OF_MASS,
    common: CommonOptions = COMMON,
) -> None:
    """Find all images of a star up to a Morse index, with a certificate that none is missing.

    Parameters
    ----------
    star
        The star's place on its sphere: theta' from the spin axis and phi', degrees (the camera lies at phi' = 0); with
        --plane: r and phi.
    figure
        Save a plot of the images among the critical curves, and the star among the caustics, to this file: .png, .pdf
        or .svg.
    save
        Save everything to this file, which kerrcaustics.load reads.
    """
    common.check({"--figure": figure, "--save": save})
    check_ending(figure)
    scale = scaling.scale(camera)
    end, place, viewer = source.end(), source.place("--star", star), camera.viewer(source.in_plane)
    began = time.perf_counter()
    with plain_errors(), progress() as report:
        from kerrcaustics.images.images import star_images
        from kerrcaustics.results import storage
        from kerrcaustics.results.records import record

        result = star_images(viewer, place, max_index, end=end, progress=report)
        seconds = time.perf_counter() - began
        if figure is not None:
            report("drawing", 1.0)
            _draw(result, figure, scale)
    common.write_result(record(result), seconds)
    _print_images(result, common.console(), scale)
    if save is not None:
        storage.save(save, result)
    common.say_files(figure=figure, saved=save)
    if not result.certified:
        stop(1, "The images are not certified: see the remarks.")


def _draw(images: "StarImages", path: Path, scale: "PhysicalScale | None") -> None:
    from kerrcaustics.curves.caustic_search import caustics
    from kerrcaustics.draw.image_figure import images_figure

    curves = caustics(images.camera, images.max_index + 1, end=images.surface)
    write_figure(images_figure(images, curves, scale), path)


def _print_images(images: "StarImages", out: Console, scale: "PhysicalScale | None") -> None:
    surface, camera = images.surface, images.camera
    place = place_in_words(surface, images.star)
    say(out, f"{place_of(camera)}: images of the source at {place} on {surface.in_words()}")
    sky_unit, length, sky = camera.sky_unit, 1.0, camera.sky_coordinates
    if scale is not None and scale.distance is not None:
        sky_unit, length, sky = "microarcseconds", scale.microarcseconds, f"{sky} (uas)"
    time_unit, each = ("", 1.0) if scale is None else scale.time_unit
    time_error = np.max(images.time_error, initial=0.0) * each
    rows = rows_of(images)
    for row, ratio in zip(rows, _ratios(images), strict=True):
        row.ratio, row.time, row.error, row.sky = ratio, row.time * each, row.error * length, row.sky * length
    columns = {
        "index": "index",
        "parity": lambda image: "+" if image.parity > 0 else "-",
        sky: "sky:+z.5f",
        place_heads(surface)[1]: "azimuth:z.3f",
        magnification_head(images): "magnification:.4g",
        **({"ratio": "ratio:.4g"} if has_ratio(camera, surface) else {}),
        "cross\N{SOFT HYPHEN}ings": "crossings",
        "redshift": "redshift:.5f",
        "error": "error:.0e",
        f"time ({time_unit})" if time_unit else "time": "time:z.6f",
    }
    out.print(table_of(rows, columns))
    say_all(out, images.remarks)
    if has_ratio(camera, surface):
        say(out, "ratio: solid angle of an image by that of the star without the hole")
    say(out, f"{index_counts(images.per_index)}: {verdict(images.certified)}; errors on the sky in {sky_unit}")
    if len(images):
        relative = [np.max(images.magnification_error / images.magnification), np.max(images.redshift_error)]
        of_time = f"{time_error:.0e} {time_unit}".rstrip()
        say(out, f"largest errors: magnification {relative[0]:.0e} of it, redshift {relative[1]:.0e}, time {of_time}")


def _ratios(images: "StarImages") -> list[float]:
    """The solid angle of each image by that of the star without the hole; NaN where the star would not be seen."""
    if not has_ratio(images.camera, images.surface):
        return [math.nan] * len(images)
    radius = images.camera.radius
    # The screen is a stereographic projection: a solid angle there covers an area larger by this, in M^2.
    area = (radius * (1 + np.sum(images.sky**2, axis=1) / (2 * radius) ** 2)) ** 2
    return (images.magnification / area).tolist()
