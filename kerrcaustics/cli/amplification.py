"""The command `amplification`: the waves of one star, finite at caustics."""

import cmath
import math
import time
from typing import TYPE_CHECKING

from rich.console import Console

from kerrcaustics.choices import WaveMethod, number_suggestion
from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.options import (
    COMMON,
    SKY_SOURCES,
    Angles,
    CameraOptions,
    CommonOptions,
    FileName,
    MaxIndex,
)
from kerrcaustics.cli.outputs import check_ending, check_table, write_figure, write_table
from kerrcaustics.cli.tables import PlainTable
from kerrcaustics.cli.terminal import place_in_words, place_of, plain_errors, progress, say, say_all, verdict

if TYPE_CHECKING:
    from kerrcaustics.waves.amplification import Amplification

# Number of frequencies of a range by default.
_COUNT = 200
# Largest number of frequencies of a range.
_MOST_COUNT = 100_000
# Most frequencies that are printed.
_SHOWN = 12


@app.command(
    **with_examples(
        "amplification --spin 0.9 --radius 10 --star 80 166 --frequency 1:100 --figure waves.png",
        "amplification --spin 0 --radius 10 --star 90 180 --frequency 2 --table waves.csv",
        "amplification --spin 0.9 --radius inf --inclination 60 --star 80 166 --source-radius 20 --frequency 1:10",
    )
)
def amplification(
    *,
    camera: CameraOptions,
    star: Angles,
    frequency: str,
    max_index: MaxIndex = 2,
    source_radius: float = math.inf,
    method: WaveMethod = "auto",
    figure: FileName | None = None,
    table: FileName | None = None,
    save: FileName | None = None,
    common: CommonOptions = COMMON,
) -> None:
    """Compute the wave amplification of a star: all images with their phases, finite on caustics.

    Parameters
    ----------
    star
        Place of the star: theta' from the spin axis and phi', degrees; the camera lies at phi' = 0.
    frequency
        Angular frequency times the mass, or a range LOW:HIGH or LOW:HIGH:COUNT with logarithmic steps.
    source_radius
        Radius of the sphere on which the star lies, in units of the mass; by default the celestial sphere.
    method
        Method to use: auto, images, fold, cusp, ring or line.
    figure
        Save a plot of the modulus of the field against frequency to this file: .png, .pdf or .svg.
    table
        Write the field at each frequency to this file: .csv, or .fits (needs astropy), which also holds the images.
    save
        Save everything to this file, which kerrcaustics.load reads.
    """
    common.check({"--figure": figure, "--table": table, "--save": save})
    check_ending(figure)
    check_table(table)
    omega = _frequencies(frequency)
    place, viewer = SKY_SOURCES.place("--star", star), camera.viewer()
    began = time.perf_counter()
    with plain_errors({"source": "star", "frequencies": "frequency", "end": "source-radius"}), progress() as report:
        from kerrcaustics.results import storage
        from kerrcaustics.results.records import record
        from kerrcaustics.waves import amplification as waves

        result = waves.amplification(
            viewer, place, omega, max_index=max_index, end=source_radius, method=method, progress=report
        )
        seconds = time.perf_counter() - began
        if save is not None:
            storage.save(save, result)
        if table is not None:
            write_table(result, table)
        if figure is not None:
            report("drawing", 1.0)
            from kerrcaustics.draw.waves import amplification_figure

            write_figure(amplification_figure(result), figure)
    common.write_result(record(result), seconds)
    _print(result, common.console())
    common.say_files(figure=figure, table=table, saved=save)
    if not result.certified:
        stop(1, "The images are not certified: see the remarks.")


def _frequencies(text: str) -> list[float]:
    """A number, or a range with steps in proportion."""
    try:
        low, *rest = [float(part) for part in text.split(":")]
    except ValueError:
        end = number_suggestion(text)
        raise BadInput(f"Argument --frequency must be a number or LOW:HIGH:COUNT, but is {text}{end}") from None
    if not rest:
        return [low]
    count = int(rest[1]) if len(rest) > 1 else _COUNT
    if len(rest) > 2 or not 0 < low < rest[0] < math.inf or not 2 <= count <= _MOST_COUNT:
        raise BadInput(
            f"Argument --frequency must be LOW:HIGH:COUNT with 0 < LOW < HIGH and a COUNT of 2 to {_MOST_COUNT}, but "
            f"is {text}."
        )
    return [low * (rest[0] / low) ** (i / (count - 1)) for i in range(count)]


def _print(result: "Amplification", out: Console) -> None:
    place = place_in_words(result.surface, result.source)
    say(out, f"{place_of(result.camera)}: waves of a star at {place} on {result.surface.in_words()}")
    table = PlainTable(("frequency", "|F|", "phase (rad)", "error", "method"))
    count = len(result.frequency)
    rows = range(count) if count <= _SHOWN else [round(i * (count - 1) / (_SHOWN - 1)) for i in range(_SHOWN)]
    for i in rows:
        size, phase = cmath.polar(complex(result.value[i]))
        table.add_row(
            f"{result.frequency[i]:.5g}", f"{size:.6g}", f"{phase:.5f}", f"{result.error[i]:.1e}", result.method[i]
        )
    out.print(table)
    say_all(out, result.remarks)
    say(out, f"{len(result.image_index)} images: {verdict(result.certified)}")
