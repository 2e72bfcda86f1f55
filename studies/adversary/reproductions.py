"""Claims that do not hold, as Python to paste: with simple numbers where those break the claim as well."""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc

from .cases import Case
from .claims import diameters
from .trials import Judged, Trial, judge
from .truth import Known, Lost

# What a result says beside its numbers.
_DOUBTS = ("azimuth_error", "status_certain", "index_certain", "crossings_certain")
# A simpler ray breaks the claim as well if it breaks it by this.
_AS_WELL = 3.0


class Broken(NamedTuple):
    """A claim that does not hold for one ray: by how much, the true end, and what was said instead."""

    claim: str
    ratio: float
    trial: Trial
    case: Case
    truth: Known | Lost | None
    said: str

    @classmethod
    def worst(cls, claim: str, judged: Judged) -> "Broken":
        """The worst ray of a trial."""
        ratio = judged.ratios[claim]
        i = int(np.nanargmax(ratio))
        case = judged.case._replace(sky=judged.case.sky[i : i + 1], families=[judged.case.families[i]])
        return cls(claim, float(ratio[i]), judged.trial, case, judged.truths[i], _says(judged.result, i))

    @property
    def code(self) -> str:
        """The call."""
        camera, end, trial = self.case.camera, self.case.end, self.trial
        function = "trace_beams" if trial.beams else "trace_rays"
        where = "" if end == math.inf else f", end={f'kc.{end}' if isinstance(end, kc.EquatorialPlane) else repr(end)}"
        place = f"kc.Camera({camera.spin!r}, {camera.radius!r}, {camera.inclination!r}, {camera.velocity!r})"
        return (
            f"kc.{function}({place}, {self.case.sky.tolist()}, {trial.engine!r}, {trial.tolerance:g}{where}, time=True)"
        )

    def __str__(self) -> str:
        """Python to paste, with what is claimed and what is true."""
        what = f"{self.claim}: {self.ratio:.3g} times what is claimed ({self.case.families[0]})"
        return f"# {what}\n{self.code}\n# says {self.said}\n# true {_in_words(self.truth)}\n"


def simplified(one: Broken) -> Broken:
    """The same claim broken by a simpler camera, direction or end."""
    rng = np.random.default_rng(0)
    for simpler in _simpler(one):
        try:
            (judged,) = judge(simpler(one.case), (one.trial,), 1.0, rng)
        except ValueError:
            continue
        ratio = judged.ratios.get(one.claim, np.zeros(1))[0]
        if ratio > min(_AS_WELL, one.ratio):
            one = Broken.worst(one.claim, judged)
    return one


def _simpler(one: Broken) -> Iterator[Callable[[Case], Case]]:
    """Ways to make a case simpler: at rest, on the equator, fewer digits."""

    at_rest, equator, inclined = {"velocity": (0.0, 0.0, 0.0)}, {"inclination": math.pi / 2}, {"inclination": 1.0}
    for changes in (at_rest, equator, inclined):
        yield lambda case, c=changes: _moved(case, **c)
    for digits in (1, 2, 3, 6, 10):
        for name in ("spin", "radius", "inclination"):
            yield lambda case, n=name, d=digits: _moved(case, **{n: _round(getattr(case.camera, n), d)})
        yield lambda case, d=digits: _moved(case, velocity=tuple(_round(v, d) for v in case.camera.fido_velocity()))
        yield lambda case, d=digits: case._replace(sky=np.array([[_round(x, d) for x in n] for n in case.sky]))
        if isinstance(one.case.end, float) and math.isfinite(one.case.end):
            yield lambda case, d=digits: case._replace(end=_round(case.end, d))


def _moved(case: Case, **changes) -> Case:
    """The case with another camera."""
    camera = case.camera
    numbers = {name: getattr(camera, name) for name in ("spin", "radius", "inclination", "velocity")}
    return case._replace(camera=kc.Camera(**numbers | changes))


def _round(x: float, digits: int) -> float:
    return float(f"{x:.{digits}g}")


def _in_words(one: Known | Lost | None) -> str:
    """The truth in a line."""
    if not isinstance(one, Known):
        return "not known" if one is None else "captured" if one.captured else "missed"
    numbers = {"n'": one.direction.tolist(), "azimuth": one.azimuth, "radius": one.radius, "time": one.time}
    numbers |= {"diameters": diameters(one), "index": one.index, "crossings": one.crossings}
    return ", ".join(f"{name} {value}" for name, value in numbers.items())


def _says(result: kc.Rays, i: int) -> str:
    """The answer of a result for a ray, in a line."""
    said = [
        f"status {kc.Status(int(result.status[i])).name}",
        f"n' {result.direction[i].tolist()} +- {result.error[i]}",
    ]
    said.append(f"azimuth {result.azimuth[i]}")
    if result.time is not None and result.time_error is not None:
        said.append(f"time {result.time[i]} +- {result.time_error[i]}")
    if isinstance(result, kc.Beams):
        both = (float(result.delta_plus[i]), float(result.delta_minus[i]))
        said.append(f"diameters {both} +- {result.diameter_error[i]}")
        said += [f"{name} {getattr(result, name)[i]}" for name in ("index", "crossings")]
    return ", ".join(
        [*said, *(f"{d} {getattr(result, d)[i]}" for d in _DOUBTS if getattr(result, d, None) is not None)]
    )
