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
    direction_head,
    place_of,
    plain_errors,
    progress,
    say,
    sure,
)

if TYPE_CHECKING:
    from kerrcaustics.spacetime.viewer import Viewer
    from kerrcaustics.stars.images import StarImages
    from kerrcaustics.stars.plane_images import PlaneImages


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
        from kerrcaustics.stars.plane_images import PlaneImages

        found = star_images(seen_from, place, max_index, end=end)
    common.write_found(record(found, camera=seen_from), time.perf_counter() - began)
    if isinstance(found, PlaneImages):
        _print_plane(seen_from, found, common.console())
    else:
        _print_images(seen_from, found, common.console())
    if not found.certified:
        stop(1, "The images are not certified: see the remarks.")


def _unit(camera: "Viewer") -> str:
    return f"errors on the sky in {camera.sky_unit}"


def _print_images(camera: "Viewer", found: "StarImages", out: Console) -> None:
    theta, phi = (math.degrees(angle) for angle in found.star)
    where = "" if math.isinf(found.source_radius) else f", r = {found.source_radius:.12g}"
    say(out, f"{place_of(camera)}: images of the star at theta' = {theta:z.12g}, phi' = {phi:z.12g} deg{where}")
    heads = (
        "index",
        "parity",
        direction_head(camera),
        "phi' (deg)",
        "magnifi\N{SOFT HYPHEN}cation",
        "cross\N{SOFT HYPHEN}ings",
        "redshift",
        "error",
    )
    table = PlainTable(heads if found.time is None else (*heads, "time"))
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
            *([] if found.time is None else [f"{found.time[i]:z.6f}"]),
        )
    out.print(table)
    for remark in found.remarks:
        say(out, remark)
    say(out, f"{counted(found.per_index)}: {sure(found.certified)}; {_unit(camera)}")


def _print_plane(camera: "Viewer", found: "PlaneImages", out: Console) -> None:
    where = f"r = {found.radius:.12g}, phi = {math.degrees(found.phi):z.12g} deg"
    say(out, f"{place_of(camera)}: images of the source at {where}, crossing {found.crossing} of the plane")
    table = PlainTable(("index", direction_head(camera), "phi (deg)", "redshift", "time", "error"))
    for i in range(len(found)):
        table.add_row(
            str(found.index[i]),
            " ".join(f"{x:+z.5f}" for x in found.sky[i]),
            f"{math.degrees(found.azimuth[i]):z.3f}",
            f"{found.redshift[i]:.5f}",
            f"{found.time[i]:z.6f}",
            f"{found.error[i]:.0e}",
        )
    out.print(table)
    for remark in found.remarks:
        say(out, remark)
    say(out, f"{counted(found.per_index)}: {sure(found.certified)}; {_unit(camera)}")
