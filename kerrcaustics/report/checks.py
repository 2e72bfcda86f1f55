"""Checks of caustics and image counts, one or many from a TOML file: for the tests of other projects.

A check is met only if it is met within the errors: a number whose error reaches beyond a range decides nothing.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec

from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.curves.caustic_search import HIGHEST_ORDER, caustics
from kerrcaustics.images.images import StarImages, star_images
from kerrcaustics.results.storage import load
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.observer import Observer
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.toml_files import as_struct, read_toml

HOLDS = "check file"
"""What the file is called in messages."""

_HIGHEST_INDEX = 6
_Range = tuple[float, float]
# What a caustic may have to lie in a range. In degrees, but for circuits.
_RANGED = ("circuits", "theta_min", "theta_max", "theta_extent", "phi_extent")
# Those that are one extreme of the caustic; the others are a difference of two.
_EXTREMES = ("theta_min", "theta_max")


class ViewerPlace(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """A viewer, whose velocity changes neither caustics nor counts.

    spin: of the hole, 0 <= spin < 1.
    radius: of the camera, units of the mass; inf for an observer at infinity.
    inclination: degrees.
    name: what the check is called; by default what it is about.
    """

    spin: float
    radius: float
    inclination: float = 90.0
    name: str = ""

    def viewer(self) -> Viewer:
        """The camera at rest, or the observer at infinity."""
        angle = math.pi / 2 if self.inclination == 90 else math.radians(self.inclination)
        if math.isinf(self.radius):
            return Observer(spin=self.spin, inclination=angle)
        return Camera(self.spin, self.radius, angle, "fiducial")

    def in_words(self) -> str:
        """The place."""
        return f"a = {self.spin:.12g}, r = {self.radius:.12g}, {self.inclination:.12g} degrees"


class CausticCheck(ViewerPlace, frozen=True):
    """What a caustic must be.

    order: 1 is the primary one.
    kind: as `Caustic.kind` says it; "astroid" has four cusps.
    closed: whether its ends meet.
    cusps: number of cusps.
    circuits: least and largest number of circuits about the spin axis.
    theta_min: least and largest value of its least theta', degrees.
    theta_max: least and largest value of its largest theta', degrees.
    theta_extent: least and largest width in theta', degrees.
    phi_extent: least and largest width in phi', degrees.
    """

    order: int
    kind: str = "astroid"
    closed: bool = True
    cusps: int | None = None
    circuits: _Range | None = None
    theta_min: _Range | None = None
    theta_max: _Range | None = None
    theta_extent: _Range | None = None
    phi_extent: _Range | None = None


class StarCheck(ViewerPlace, frozen=True):
    """How many images a star on the celestial sphere must have.

    star: theta' and phi' relative to the camera, degrees.
    counts: images of Morse index 0, 1, and so on.
    certified: whether the count must be certified.
    """

    star: tuple[float, float]
    counts: list[int]
    certified: bool = True


class StoredCheck(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """A saved result of `caustics` or `star_images` that must be found again, within the errors of both.

    file: written by `kerrcaustics.save` or `--save`, beside the check file unless its path is absolute.
    name: what the check is called.
    """

    file: str
    name: str = ""


class CheckFile(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """All checks of a file: tables [[caustic]], [[star]] and [[stored]]."""

    caustic: list[CausticCheck] = []
    star: list[StarCheck] = []
    stored: list[StoredCheck] = []


@dataclass(frozen=True)
class Outcome:
    """What became of a check.

    name: what it is called.
    met: whether it is met.
    found: what was found, in words.
    faults: what is not as it must be, in words; none if it is met.
    """

    name: str
    met: bool
    found: str
    faults: tuple[str, ...]

    def record(self) -> dict[str, Any]:
        """The outcome as plain data."""
        return {"name": self.name, "met": self.met, "found": self.found, "faults": list(self.faults)}

    @property
    def line(self) -> str:
        """The outcome in one line."""
        return f"{'ok  ' if self.met else 'FAIL'} {self.name}: {'; '.join(self.faults) or self.found}"


def read_checks(path: str | Path) -> CheckFile:
    """The checks of a file; a ValueError of one line names what is wrong and where."""
    checks = as_struct(read_toml(path, HOLDS), CheckFile, path, HOLDS)
    for entry, must, value in _complaints(checks, Path(path).parent):
        raise ValueError(f"Check file {path}: {entry} must be {must}, but is {value}.")
    return checks


def _complaints(checks: CheckFile, folder: Path) -> Iterator[tuple[str, str, Any]]:
    if not (checks.caustic or checks.star or checks.stored):
        yield "it", "a list of [[caustic]], [[star]] or [[stored]] tables", "without any"
    for kind in ("caustic", "star"):
        for number, check in enumerate(getattr(checks, kind), 1):
            try:
                check.viewer()
            except ValueError as error:
                yield f"[[{kind}]] {number}", "a place outside a hole", f"not: {error}".rstrip(".")
    for number, check in enumerate(checks.caustic, 1):
        if not 1 <= check.order <= HIGHEST_ORDER:
            yield f"[[caustic]] {number}, order", f"from 1 to {HIGHEST_ORDER}", check.order
        for name in _RANGED:
            limits = getattr(check, name)
            if limits is not None and not limits[0] <= limits[1]:
                yield f"[[caustic]] {number}, {name}", "the least and the largest value", list(limits)
    for number, check in enumerate(checks.star, 1):
        if not 1 <= len(check.counts) <= _HIGHEST_INDEX + 1:
            yield f"[[star]] {number}, counts", f"a list of 1 to {_HIGHEST_INDEX + 1} numbers", check.counts
        if not 0 <= check.star[0] <= 180:
            yield f"[[star]] {number}, star", "theta' in [0, 180] and phi', degrees", list(check.star)
    for number, check in enumerate(checks.stored, 1):
        if not (folder / check.file).is_file():
            yield f"[[stored]] {number}, file", "the name of a file that exists", check.file


def outcomes(checks: CheckFile, folder: str | Path = ".") -> Iterator[Outcome]:
    """Each check carried out, in the order of the tables of the file.

    Parameters
    ----------
    checks : CheckFile
    folder : path
        The folder of stored results.

    Errors
    ------
    Numbers are compared within their errors, so that a check that is met is met by the true numbers.
    """
    highest: dict[Viewer, int] = {}
    for check in checks.caustic:
        highest[check.viewer()] = max(highest.get(check.viewer(), 1), check.order)

    @lru_cache
    def curves_at(viewer: Viewer) -> CausticSet:
        return caustics(viewer, highest[viewer])

    for check in checks.caustic:
        yield caustic_outcome(check, curves_at(check.viewer()))
    yield from map(_of_star, checks.star)
    for stored in checks.stored:
        yield _of_stored(stored, Path(folder) / stored.file)


def _outcome(name: str, found: str, faults: list[str]) -> Outcome:
    return Outcome(name, not faults, found, tuple(faults))


def caustic_outcome(check: CausticCheck, curves: CausticSet) -> Outcome:
    """What becomes of a check of one of a viewer's caustics, which are computed already."""
    name = check.name or f"caustic {check.order} at {check.in_words()}"
    curve = next((one for one in curves if one.order == check.order), None)
    if curve is None:
        return _outcome(name, "", ["it was not found"])
    faults = []
    if curve.kind != check.kind:
        faults.append(f"it is {curve.kind}, and must be {check.kind}")
    if curve.closed != check.closed:
        faults.append(f"its ends {'meet' if curve.closed else 'do not meet'}")
    if check.cusps is not None and len(curve.cusps) != check.cusps:
        faults.append(f"it has {len(curve.cusps)} cusps, and must have {check.cusps}")
    for quantity in _RANGED:
        if (limits := getattr(check, quantity)) is not None:
            faults += _range_faults(quantity, *value_and_error(curve, quantity), limits)
    if not curve.certified:
        faults += curve.remarks or ("it is not certified",)
    shape = f"{curve.kind}, {'closed' if curve.closed else 'open'}, {len(curve.cusps)} cusps"
    size = f"{curve.circuits:.6g} circuits, {math.degrees(curve.theta_extent):.6g} by "
    return _outcome(name, f"{shape}, {size}{math.degrees(curve.phi_extent):.6g} degrees", faults)


def value_and_error(curve: Caustic, quantity: str) -> tuple[float, float]:
    """An extreme or an extent in degrees, or circuits, and its error; each extreme has the error of the curve."""
    unit = 1 / (2 * math.pi) if quantity == "circuits" else math.degrees(1)
    value = curve.circuits if quantity == "circuits" else math.degrees(getattr(curve, quantity))
    return value, (1 if quantity in _EXTREMES else 2) * curve.error * unit


def _range_faults(quantity: str, value: float, error: float, limits: _Range) -> list[str]:
    """A fault in words unless a number lies in a range with all of its error."""
    low, high = limits
    if low <= value - error and value + error <= high:
        return []
    undecided = value + error >= low and value - error <= high
    found = f"{value:.12g} +- {error:.1g}"
    return [f"{quantity} is {found}, {'which decides nothing about' if undecided else 'outside'} [{low:g}, {high:g}]"]


def _of_star(check: StarCheck) -> Outcome:
    theta, phi = map(math.radians, check.star)
    images = star_images(check.viewer(), (theta, phi), len(check.counts) - 1)
    counts, faults = list(images.per_index.values()), []
    if counts != check.counts:
        faults.append(f"it has {_sum_of_counts(counts)}, and must have {_sum_of_counts(check.counts)}")
    if images.certified != check.certified:
        faults += images.remarks or (f"the count is {'' if images.certified else 'not '}certified",)
    name = check.name or f"star {check.star[0]:.12g} {check.star[1]:.12g} at {check.in_words()}"
    return _outcome(name, f"{_sum_of_counts(counts)}{', certified' * images.certified}", faults)


def _sum_of_counts(counts: list[int]) -> str:
    """Counts in words, with the highest index that was asked for."""
    noun = "image" if sum(counts) == 1 else "images"
    return f"{' + '.join(map(str, counts))} {noun} of index {'0 to ' * (len(counts) > 1)}{len(counts) - 1}"


def _of_stored(check: StoredCheck, path: Path) -> Outcome:
    name = check.name or f"stored {check.file}"
    try:
        stored = load(path)
    except ValueError as error:
        return _outcome(name, "", [str(error).rstrip(".")])
    compared: dict[type, Callable[[Any], list[str]]] = {CausticSet: _other_caustics, StarImages: _other_images}
    if type(stored) not in compared:
        kinds = " or ".join(kind.__name__ for kind in compared)
        return _outcome(name, "", [f"it holds {type(stored).__name__}, and must hold {kinds}"])
    return _outcome(name, f"{stored!r} is found again", compared[type(stored)](stored))


def _other_caustics(stored: CausticSet) -> list[str]:
    """What differs from stored caustics in caustics found now."""
    highest = max([*(curve.order for curve in stored), *stored.missing], default=1)
    now = {curve.order: curve for curve in caustics(stored.camera, highest, end=stored.surface)}
    faults = []
    for curve in stored:
        if curve.order not in now:
            faults.append(f"order {curve.order}: not found now")
            continue
        other = now[curve.order]
        if (other.kind, other.closed) != (curve.kind, curve.closed):
            faults.append(f"order {curve.order}: {other.kind} now, {curve.kind} stored")
        error = curve.error + other.error
        for quantity in ("theta_min", "theta_max", "phi_min", "phi_max"):
            off = abs(getattr(curve, quantity) - getattr(other, quantity))
            if not off <= error:
                faults.append(f"order {curve.order}: {quantity} differs by {off:.1e} rad, more than both errors")
    return faults


def _other_images(stored: StarImages) -> list[str]:
    """What differs from stored images in images found now."""
    now = star_images(stored.camera, stored.star, stored.max_index, end=stored.surface)
    if now.per_index != stored.per_index:
        counts = [_sum_of_counts(list(images.per_index.values())) for images in (now, stored)]
        return [f"{counts[0]} now, {counts[1]} stored"]
    free, faults = set(range(len(now))), []
    for i in range(len(stored)):
        gaps = {j: math.dist(stored.sky[i], now.sky[j]) for j in free if now.index[j] == stored.index[i]}
        nearest = min(gaps, key=gaps.__getitem__)
        free.remove(nearest)
        if not gaps[nearest] <= stored.error[i] + now.error[nearest]:
            faults.append(
                f"an image of index {stored.index[i]} has moved by {gaps[nearest]:.1e}, more than both errors"
            )
    return faults
