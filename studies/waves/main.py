"""Check that all ways to compute the waves of a source agree, and compare their errors with their times.

    kerrcaustics study waves

Random viewers with spin, sources anywhere or beside caustics of order 1 to 3, and frequencies of 0.5 to 100. Each
method that `kc.amplification` has (the sum of images, pairs in closed form, one integral for each ring) computes the
same field, with an error of its own. Wrong are two methods that differ by more than both errors; where the images are
not certified, nothing is held against them. Without spin, partial waves (`truth/partial_waves.py`) share nothing with
rays: the same methods against them, at ten angles.
The picture shows, by run time, the reported error of every method in parts of the field, and as small dots how much it
really is off: from partial waves, and from the most exact other method.
Writes waves.json, waves.png and waves.md.
"""

import math
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table
from kerrcaustics.spacetime.viewer import Viewer

from ..truth.partial_waves import field as partial_waves

QUESTION = "Do the methods for waves agree?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 540
QUICK_SECONDS = 20

CASES, HIGHEST = 300, 2
METHODS = "images", "fold", "cusp", "ring", "line", "auto"
# Angles between the source and the direction opposite to the camera, and frequencies, for partial waves.
ANGLES, LONG_WAVES, RADIUS, INDICES = (
    (0.001, 0.01, 0.05, 0.2, 0.5, 1.0, 1.8, 2.6, 3.0, 3.13),
    (0.5, 1, 2, 5, 10),
    10.0,
    5,
)


@dataclass(frozen=True)
class Field:
    """The field of one source at one frequency by one method.

    case: number of the source; value: its modulus; error: reported; off: how far it is from the truth or from the most
    exact other method; allowed: both errors; seconds: of one source with all its frequencies.
    """

    case: int
    method: str
    frequency: float
    value: float
    error: float
    off: float
    allowed: float
    certified: bool
    seconds: float

    @property
    def relative_error(self) -> float:
        """Of the field; infinite where a method has none."""
        return self.error / self.value if self.value else math.inf

    @property
    def relative_off(self) -> float:
        """The difference in parts of the field."""
        return self.off / self.value if self.value else math.inf

    @property
    def wrong(self) -> bool:
        """True if the difference is more than both errors."""
        return self.certified and self.off > self.allowed


def random_source(chance: np.random.Generator) -> tuple[Viewer, tuple[float, float]]:
    """A viewer with spin, and a source: half of them within 0.3 of a caustic."""
    spin, inclination = float(chance.uniform(0.01, 0.999)), math.acos(float(chance.uniform(-0.99, 0.99)))
    radius = 2.5 * 400 ** float(chance.uniform())
    viewer: Viewer = kc.Camera(spin, radius, inclination, "fiducial")
    if chance.uniform() < 0.5:
        return viewer, (math.acos(float(chance.uniform(-1, 1))), float(chance.uniform(0, 2 * math.pi)))
    order = int(chance.integers(1, 4))
    caustic = kc.caustics(viewer, order)[order - 1]
    theta, phi = caustic.place[int(chance.integers(len(caustic.place)))].tolist()
    away, turn = 10 ** float(chance.uniform(-5, math.log10(0.3))), float(chance.uniform(0, 2 * math.pi))
    theta = min(max(theta + away * math.cos(turn), 1e-3), math.pi - 1e-3)
    return viewer, (theta, phi + away * math.sin(turn) / max(math.sin(theta), 0.1))


def fields(
    viewer: Viewer, source: tuple[float, float], omega: np.ndarray, case: int, true: np.ndarray | None
) -> list[Field]:
    """The fields by all methods; true: the field, where it is known."""
    seen, seconds = {}, {}
    highest = HIGHEST if true is None else INDICES
    for method in METHODS:
        began = time.perf_counter()
        seen[method] = kc.amplification(viewer, source, omega, max_index=highest, method=method)
        seconds[method] = time.perf_counter() - began
    found = []
    for method, one in seen.items():
        for k, frequency in enumerate(omega.tolist()):
            if true is None:
                # Methods may be the same here, as beside no fold, and `auto` is one of the others.
                others = [other for other in seen.values() if abs(other.value[k] - one.value[k]) > 1e-13]
                best = min(others, key=lambda other: other.error[k], default=one)
                off, allowed = abs(one.value[k] - best.value[k]), one.error[k] + best.error[k]
            else:
                off, allowed = abs(one.value[k] - true[k]), one.error[k]
            found.append(
                Field(
                    case,
                    method,
                    frequency,
                    float(abs(one.value[k])),
                    float(one.error[k]),
                    float(off),
                    float(allowed),
                    one.certified,
                    seconds[method],
                )
            )
    return found


def without_spin() -> list[Field]:
    """All methods against partial waves."""
    camera = kc.Camera(0.0, RADIUS, velocity="fiducial")
    omega = np.array(LONG_WAVES, float)
    found = []
    # Its radial functions are those of all angles.
    true = np.stack([partial_waves(frequency, RADIUS, np.array(ANGLES)) for frequency in LONG_WAVES], axis=1)
    for case, angle in enumerate(ANGLES):
        found += fields(camera, (math.pi / 2, math.pi - angle), omega, case, true[case])
    return found


def picture(parts: dict[str, list[Field]]) -> Figure:
    """The figure of the study: errors by run time."""
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.9), layout="constrained")
        axes = figure.subplots(1, len(parts), sharey=True)
        for ax, (title, found) in zip(axes, parts.items(), strict=True):
            for colour, method in zip(style.PALETTE, METHODS, strict=False):
                chosen = [field for field in found if field.method == method]
                dots = {"color": colour, "markeredgewidth": 0, "linestyle": "none"}
                seconds = [field.seconds for field in chosen]
                errors = [field.relative_error for field in chosen]
                ax.plot(seconds, errors, "o", markersize=3.5, label=method, **dots)
                off = [max(field.relative_off, 1e-12) for field in chosen]
                ax.plot(seconds, off, ".", markersize=1.8, alpha=0.7, **dots)
            ax.set(xscale="log", yscale="log", xlabel="run time (s)", title=title, ylim=(1e-9, 30))
            ax.legend(loc="lower left", markerscale=1.3)
        axes[0].set_ylabel("error, in parts of the field")
    return figure


def table(parts: dict[str, list[Field]]) -> str:
    """Per method: how often it holds, its error, how far it is off, and what it costs."""
    heads = ["against", "method", "fields", "wrong", "median error", "median off", "largest off by error", "median s"]
    lines = []
    for title, found in parts.items():
        for method in METHODS:
            chosen = [field for field in found if field.method == method]
            ratios = [field.off / field.allowed for field in chosen if field.certified and field.allowed > 0]
            lines.append(
                [
                    title,
                    method,
                    str(len(chosen)),
                    str(sum(field.wrong for field in chosen)),
                    f"{np.median([field.relative_error for field in chosen]):.2g}",
                    f"{np.median([field.relative_off for field in chosen]):.2g}",
                    f"{max(ratios):.2g}" if ratios else "",
                    f"{np.median([field.seconds for field in chosen]):.2g}",
                ]
            )
    return markdown_table(heads, lines)


def findings(parts: dict[str, list[Field]]) -> list[str]:
    """Findings, a sentence for each part."""
    lines = []
    for title, found in parts.items():
        wrong, sources = sum(field.wrong for field in found), len({field.case for field in found})
        held = sum(field.certified for field in found)
        lines.append(
            f"Against {title}: of {held} certified fields of {sources} sources {wrong} are off by more than errors."
        )
    return lines


QUICK: dict[str, Any] = {"cases": 8}
"""Arguments of `main` for a quick run."""


def main(output: Path, cases: int = CASES, seed: int = 1965, longest: float = math.inf) -> list[Path]:
    """Run the study; the files in `output`. cases: random sources; longest: seconds after which none is begun."""
    began = time.perf_counter()
    chance = np.random.default_rng(seed)
    random: list[Field] = []
    for case in range(cases):
        if time.perf_counter() - began > longest:
            break
        viewer, source = random_source(chance)
        omega = np.sort(0.5 * 200 ** chance.uniform(size=3))
        random += fields(viewer, source, omega, case, None)
    parts = {"partial waves, no spin": without_spin(), "each other, with spin": random}
    text = table(parts)
    print(text)
    return write_study(
        output,
        "waves",
        __doc__ or "",
        picture(parts),
        text,
        settings={"random sources": cases, "seed": seed},
        findings=findings(parts),
        wrong=[asdict(field) for found in parts.values() for field in found if field.wrong],
        fields={title: [asdict(field) for field in found] for title, found in parts.items()},
        seconds=time.perf_counter() - began,
    )
