"""The command `images`: the images of a star."""

import math
import time
from typing import TYPE_CHECKING

from rich.console import Console

from kerrcaustics.cli.app import app, stop
from kerrcaustics.cli.options import COMMON, Angles, CameraOptions, CommonOptions, MaxIndex, radians
from kerrcaustics.cli.terminal import WIDE, counted, place_of, plain_errors, plain_table, progress, say, sure

if TYPE_CHECKING:
    from kerrcaustics.spacetime.camera import Camera
    from kerrcaustics.stars.images import StarImages


@app.command
def images(*, camera: CameraOptions, star: Angles, max_index: MaxIndex = 2, common: CommonOptions = COMMON) -> None:
    """Find all images of a star up to a Morse index, and say whether none is missing.

    Parameters
    ----------
    star
        The star's place on the celestial sphere: theta' from the spin axis and phi', degrees.
    """
    common.check()
    place = radians("--star", star)
    seen_from = camera.made()
    began = time.perf_counter()
    with plain_errors(), progress():
        from kerrcaustics.results.records import record
        from kerrcaustics.stars.images import star_images

        found = star_images(seen_from, place, max_index)
    common.write_found(record(found, camera=seen_from), time.perf_counter() - began)
    _print_images(seen_from, found, common.console(WIDE))
    if not found.certified:
        stop(1, "The images are not certified: see the remarks.")


def _print_images(camera: "Camera", found: "StarImages", out: Console) -> None:
    theta, phi = (math.degrees(angle) for angle in found.star)
    say(out, f"{place_of(camera)}: images of the star at theta' = {theta:.12g}, phi' = {phi:.12g} deg")
    heads = ("index", "parity", "direction N", "phi' (deg)", "magnification", "crossings", "redshift", "error")
    table = plain_table(heads)
    for i in range(len(found)):
        table.add_row(
            str(found.index[i]),
            "+" if found.parity[i] > 0 else "-",
            " ".join(f"{x:+.5f}" for x in found.sky[i]),
            f"{math.degrees(found.azimuth[i]):.3f}",
            f"{found.magnification[i]:.4g}",
            str(found.crossings[i]),
            f"{found.redshift[i]:.5f}",
            f"{found.error[i]:.0e}",
        )
    out.print(table)
    for remark in found.remarks:
        say(out, remark)
    say(out, f"{counted(found.per_index)}: {sure(found.certified)}; errors on the camera sky in radians")
