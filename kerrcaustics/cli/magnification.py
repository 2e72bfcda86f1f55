"""The command `magnification`: a source of finite size, as it is seen."""

import math
import time
from typing import TYPE_CHECKING, Any

from rich.console import Console

from kerrcaustics.choices import either, suggestion
from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.options import (
    COMMON,
    SKY_SOURCES,
    Angles,
    CameraOptions,
    CommonOptions,
    FileName,
    Flag,
    MaxIndex,
    SourceOptions,
    check_degrees,
)
from kerrcaustics.cli.outputs import check_ending, write_figure
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import (
    has_ratio,
    magnification_head,
    place_in_words,
    place_of,
    plain_errors,
    progress,
    say,
    say_all,
    verdict,
)

if TYPE_CHECKING:
    from kerrcaustics.extended_sources.magnification import Magnification

# Brightness profiles by name, as they are given.
_PROFILES = {
    "uniform": "uniform",
    "linear": "linear:u",
    "quadratic": "quadratic:u1,u2",
    "gaussian": "gaussian:width",
}
# Of a magnification and of its error.
_FORMS = ".9g", ".0e"


@app.command(
    **with_examples(
        "magnification --spin 0.999 --radius 6.03 --star 90 141 --size 0.5 --figure shapes.png",
        "magnification --spin 0 --radius 100 --star 90 180 --size 2 --profile linear:0.6",
        "magnification --spin 0.9 --radius 20 --inclination 70 --plane 1 --star 8 170 --size 0.5",
    )
)
def magnification(
    *,
    camera: CameraOptions,
    star: Angles,
    size: float,
    profile: str = "uniform",
    max_index: MaxIndex = 2,
    power: float = 0.0,
    tolerance: float = 1e-6,
    figure: FileName | None = None,
    save: FileName | None = None,
    source: SourceOptions = SKY_SOURCES,
    common: CommonOptions = COMMON,
    points: Flag = False,
) -> None:
    """Compute the magnification and the image shapes of a star of finite size, even on a caustic.

    Parameters
    ----------
    star
        Place of the star's centre: theta' from the spin axis and phi', degrees (the camera lies at phi' = 0); with
        --plane: r and phi.
    size
        Radius of the star, degrees; with --source-radius or --plane a length in units of the mass, along that sphere or
        in the plane.
    profile
        Brightness from the centre to the limb: uniform, linear:u or quadratic:u1,u2 for limb darkening,
        gaussian:width for a Gaussian whose standard deviation is width times the radius of the star.
    power
        The light scales as the frequency ratio to this power: 0 for the magnification alone, 4 for the light of all
        frequencies.
    tolerance
        Relative error of the light that is aimed at, 1e-9 to 0.1. A larger one saves time with stars that are not
        uniform.
    figure
        Save a plot of the images of the star among the critical curves to this file: .png, .pdf or .svg.
    save
        Save everything to this file, which kerrcaustics.load reads.
    points
        Include the images of the limb in the JSON.
    """
    common.check({"--figure": figure, "--save": save})
    check_ending(figure)
    common.check_points(points)
    end, place, shade = source.end(), source.place("--star", star), _profile(profile)
    wide = math.radians(size) if end == math.inf else size
    viewer = camera.viewer(source.in_plane)
    began = time.perf_counter()
    with plain_errors({"end": "source-radius"}), progress() as report:
        from kerrcaustics.extended_sources import magnification as extended
        from kerrcaustics.results import storage
        from kerrcaustics.results.records import record

        if end == math.inf:
            check_degrees("--size", size, *extended.SIZES)
        shown = {"profile": shade, "max_index": max_index, "power": power, "end": end, "tolerance": tolerance}
        result = extended.magnification(viewer, place, wide, **shown, progress=report)
        ratios = _ratios(result, place, wide, shown)
        seconds = time.perf_counter() - began
        if save is not None:
            storage.save(save, result)
        if figure is not None:
            report("drawing", 1.0)
            from kerrcaustics.draw.source_images import source_images_figure

            write_figure(source_images_figure(result), figure)
    common.write_result(record(result, points=points), seconds)
    _print(result, ratios, common.console())
    common.say_files(figure=figure, saved=save)
    if not result.certified:
        stop(1, "The magnification is not certified: see the remarks.")


def _profile(text: str) -> str | tuple[str | float, ...]:
    """A profile of the command line: its name, and the coefficients after a colon."""
    name, _, rest = text.partition(":")
    if name not in _PROFILES:
        forms = either(list(_PROFILES.values()))
        raise BadInput(f"Argument --profile must be {forms}, but is {text or 'empty'}{suggestion(name, _PROFILES)}")
    form = _PROFILES[name]
    try:
        numbers = [float(part) for part in text.split(":")[1].split(",")] if ":" in text else []
    except ValueError:
        raise BadInput(f"Argument --profile must have numbers after {name}:, but has {rest or 'none'}.") from None
    if len(numbers) != len(form.replace(":", ",").split(",")) - 1:
        raise BadInput(f"Argument --profile must be {form}, but is {text}.")
    return (name, *numbers) if numbers else name


def _ratios(
    result: "Magnification", place: tuple[float, float], wide: float, shown: dict[str, Any]
) -> "Magnification | None":
    """What a camera at the place of an observer sees, whose magnifications are ratios; None if there are none."""
    viewer = result.camera
    if not has_ratio(viewer, result.surface):
        return None
    from kerrcaustics.extended_sources.magnification import magnification as extended
    from kerrcaustics.spacetime.camera import Camera

    return extended(Camera(viewer.spin, viewer.radius, viewer.inclination, "fiducial"), place, wide, **shown)


def _print(result: "Magnification", ratios: "Magnification | None", out: Console) -> None:
    surface = result.surface
    place = place_in_words(surface, result.source)
    size = f"{result.size:g} M" if surface.finite else f"{math.degrees(result.size):g} deg"
    say(out, f"{place_of(result.camera)}: a star of radius {size} at {place} on {surface.in_words()}, {result.profile}")
    table = PlainTable(("index", magnification_head(result), "error", *(("ratio", "error of ratio") if ratios else ())))
    columns = [_shares(each) for each in (result, ratios) if each is not None]
    for index, *cells in zip([*result.per_index, f"0 to {result.max_index}"], *columns, strict=True):
        table.add_row(
            str(index), *(f"{number:{form}}" for cell in cells for number, form in zip(cell, _FORMS, strict=True))
        )
    out.print(table)
    middle = ", ".join(f"{part:+.9f}" for part in result.centroid)
    axes = "N" if len(result.centroid) == 3 else "(alpha, beta)"
    say(out, f"centroid of the light: {axes} = ({middle}), error {result.centroid_error:.0e}")
    say_all(out, result.remarks)
    if ratios is not None:
        doubt = "" if ratios.certified else ", NOT certified"
        say(out, f"ratio: light of the images by that of the star without the hole{doubt}")
    say(out, f"{len(result.images)} curves bound the images: {verdict(result.certified)}")


def _shares(result: "Magnification") -> list[tuple[float, float]]:
    """The share of each index, and the total, with their errors."""
    shares = zip(result.per_index.values(), result.per_index_error.values(), strict=True)
    return [*shares, (result.total, result.error)]
