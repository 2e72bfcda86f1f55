"""Claims of a result about its rays, each with its true error over the reported error."""

from typing import Any, NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime.sphere import polar_basis

from .truth import Known, Lost

# The claims that are a number with an error: what each of them is about. The Jacobian is that of its entries, the
# diameters are those of its columns in space too.
ERRORS = ("direction", "Jacobian", "diameters", "azimuth", "time")
# Those that are right or wrong.
LABELS = ("no NaN", "arrival", "index", "crossings")
# That a ray which is called ESCAPED is within the tolerance: true error over tolerance.
TOLERANCE = "tolerance"
CLAIMS = (*ERRORS, TOLERANCE, *LABELS)
# Diameters, minor over major, below which the truth does not know the index.
_UNRESOLVED = 1e-6


class Ends(NamedTuple):
    """Ends of n rays to compare with. status: that of an exact ray, -1 where it is not known; NaN if it is lost.

    columns (n, 3, 2): J as changes of n', of the plane those of (r, r phi) and 0. Errors are an engine's own; the truth
    has none.
    """

    status: np.ndarray
    direction: np.ndarray
    azimuth: np.ndarray
    radius: np.ndarray
    time: np.ndarray
    columns: np.ndarray
    diameters: np.ndarray
    index: np.ndarray
    crossings: np.ndarray
    error: np.ndarray | float = 0.0
    azimuth_error: np.ndarray | float = 0.0
    time_error: np.ndarray | float = 0.0
    jacobian_error: np.ndarray | float = 0.0
    diameter_error: np.ndarray | float = 0.0


def ends_of(beams: kc.Beams, end: Any) -> Ends:
    """The ends that an engine gives, for comparison with another one."""
    status = np.where(beams.escaped, kc.Status.ESCAPED, beams.status)
    diameters = np.stack([beams.delta_plus, beams.delta_minus], axis=-1)
    assert beams.index is not None and beams.crossings is not None
    unknown = np.full(len(status), np.nan)
    time, time_error = (unknown if t is None else t for t in (beams.time, beams.time_error))
    where = (beams.direction, beams.azimuth, beams.radius, time, columns_of(beams, end), diameters)
    errors = (beams.error, _azimuth_errors(beams)[0], time_error, beams.jacobian_error, beams.diameter_error)
    return Ends(status, *where, beams.index, beams.crossings, *errors)


def ends_in_truth(found: list[Known | Lost | None]) -> Ends:
    """The true ends; None is a ray of which nothing is known."""
    n = len(found)
    ends = Ends(
        np.full(n, -1),
        *(np.full((n, *shape), np.nan) for shape in ((3,), (), (), (), (3, 2), (2,))),
        np.full(n, -1),
        np.full(n, -1),
    )
    for i, one in enumerate(found):
        if isinstance(one, Lost):
            ends.status[i] = kc.Status.CAPTURED if one.captured else kc.Status.MISSED
        elif one is not None:
            ends.status[i], ends.direction[i], ends.azimuth[i] = kc.Status.ESCAPED, one.direction, one.azimuth
            ends.radius[i], ends.time[i] = one.radius, one.time
            ends.columns[i] = np.pad(one.columns, ((0, 3 - len(one.columns)), (0, 0)))
            ends.diameters[i] = diameters(one)
            ends.index[i], ends.crossings[i] = one.index, one.crossings
            # The truth looks for conjugate points in steps, and may have missed one that close to the end.
            if abs(ends.diameters[i, 1]) < _UNRESOLVED * ends.diameters[i, 0]:
                ends.index[i] = -1
    return ends


def columns_of(beams: kc.Beams, end: Any) -> np.ndarray:
    """The columns of J (n, 3, 2) in space, of the plane those of (r, r phi) and 0."""
    if isinstance(end, kc.EquatorialPlane):
        return np.pad(beams.jacobian, ((0, 0), (0, 1), (0, 0)))
    return np.stack(polar_basis(beams.direction), axis=-1) @ beams.jacobian


def ratios(result: kc.Rays, ends: Ends, end: Any, tolerance: float) -> dict[str, np.ndarray]:
    """Every claim of a result (n,): true over reported error, NaN where nothing is claimed; labels 0, inf if wrong.

    Where the ends are those of an engine, its own error is allowed for: what is left is the least that is wrong.
    """
    known, both = ends.status >= 0, (ends.status == kc.Status.ESCAPED) & result.escaped
    with np.errstate(invalid="ignore", divide="ignore"):
        off = _excess(_distance(result, ends), ends.error)
        turned, turned_error = _azimuth_off(result, ends)
        found = {"direction": off / result.error, "azimuth": turned / turned_error}
        found[TOLERANCE] = np.where(result.status == kc.Status.ESCAPED, off / tolerance, np.nan)
        if result.time is not None and result.time_error is not None:
            found["time"] = _excess(result.time - ends.time, ends.time_error) / result.time_error
        if isinstance(result, kc.Beams):
            found |= _of_beams(result, ends, end)
    found = {name: np.where(both & ~np.isnan(off), ratio, np.nan) for name, ratio in found.items()}
    wrong = known & (np.where(result.escaped, kc.Status.ESCAPED, result.status) != ends.status)
    found["arrival"] = _label(known & _certain(result, "status"), wrong)
    found["no NaN"] = _label(both, ~_is_finite(result))
    return found


def _of_beams(beams: kc.Beams, ends: Ends, end: Any) -> dict[str, np.ndarray]:
    size = ends.diameters[:, 0]
    entries = ends.columns[:, :2] if isinstance(end, kc.EquatorialPlane) else entries_of(ends)
    turned = np.linalg.norm(beams.jacobian - entries, axis=(1, 2)) / size
    bent = np.linalg.norm(columns_of(beams, end) - ends.columns, axis=(1, 2)) / size
    diameters = np.stack([beams.delta_plus, beams.delta_minus], axis=-1)
    grown = np.abs(diameters - ends.diameters).max(axis=-1) / size
    found = {
        "Jacobian": _excess(turned, ends.jacobian_error) / _known(beams.jacobian_error),
        "diameters": _excess(np.fmax(grown, bent), ends.diameter_error) / _known(beams.diameter_error),
    }
    for name in ("index", "crossings"):
        certain = _certain(beams, name) & (ends.status == kc.Status.ESCAPED) & beams.escaped
        certain = certain & (getattr(ends, name) >= 0)
        found[name] = _label(certain, getattr(beams, name) != getattr(ends, name))
    return found


def entries_of(ends: Ends) -> np.ndarray:
    """The entries of J (n, 2, 2) along e_theta' and e_phi'."""
    return np.swapaxes(np.stack(polar_basis(ends.direction), axis=-1), 1, 2) @ ends.columns


def _known(error: np.ndarray) -> np.ndarray:
    """Errors, NaN where they say that nothing is known."""
    return np.where(error < 1, error, np.nan)


def _distance(result: kc.Rays, ends: Ends) -> np.ndarray:
    """Between places of ends, in radians; in the plane also in ln r."""
    off = np.linalg.norm(result.direction - ends.direction, axis=-1)
    if not np.isfinite(ends.radius).any():
        return off
    return np.maximum(off, np.abs(np.log(result.radius / ends.radius)))


def _excess(off: np.ndarray, allowed: np.ndarray | float) -> np.ndarray:
    return np.maximum(np.abs(off) - allowed, 0)


def _azimuth_off(result: kc.Rays, ends: Ends) -> tuple[np.ndarray, np.ndarray]:
    """Difference of azimuths and what is claimed: modulo 2 pi, with the error of n', where it is known so alone."""
    off = result.azimuth - ends.azimuth
    error, turned = _azimuth_errors(result)
    modulo = np.isinf(error) | np.isinf(ends.azimuth_error)
    allowed = np.where(modulo, 2 * turned, ends.azimuth_error) * (np.asarray(ends.azimuth_error) > 0)
    off = np.where(modulo, off - 2 * np.pi * np.round(off / (2 * np.pi)), off)
    return _excess(off, allowed), np.where(np.isinf(error), turned, error)


def _azimuth_errors(result: kc.Rays) -> tuple[np.ndarray, np.ndarray]:
    """The error of the azimuth, and what the error of n' makes of it modulo 2 pi."""
    with np.errstate(invalid="ignore", divide="ignore"):
        turned = result.error / np.hypot(result.direction[:, 0], result.direction[:, 1])
    return getattr(result, "azimuth_error", turned), turned


def _label(claimed: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    return np.where(claimed, np.where(wrong, np.inf, 0.0), np.nan)


def _certain(result: kc.Rays, name: str) -> np.ndarray:
    """True where a result is certain of a label; everywhere, if it does not say."""
    certain = getattr(result, f"{name}_certain", None)
    return np.ones(result.status.shape, bool) if certain is None else certain


def _is_finite(result: kc.Rays) -> np.ndarray:
    """True if all values are numbers, and no error is NaN; one that is infinite says that nothing is known."""
    values, errors = [result.direction, result.azimuth[:, None]], [result.error]
    if isinstance(result, kc.Beams):
        values, errors = [*values, result.jacobian.reshape(-1, 4)], [*errors, result.jacobian_error]
    if result.time is not None and result.time_error is not None:
        values, errors = [*values, result.time[:, None]], [*errors, result.time_error]
    return np.isfinite(np.concatenate(values, axis=1)).all(axis=1) & ~np.isnan(errors).any(axis=0)


def diameters(one: Known) -> tuple[float, float]:
    """delta_plus and delta_minus from the true columns of J."""
    if len(one.columns) == 2:
        determinant = float(np.linalg.det(one.columns))
    else:
        determinant = float(one.direction @ np.cross(one.columns[:, 0], one.columns[:, 1]))
    major = float(np.linalg.norm(one.columns, 2))
    return major, determinant / major
