"""Results as records for JSON: angles in degrees, null for numbers that are not finite."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from kerrcaustics.results.declared import LAYOUTS, Quantity, quantities
from kerrcaustics.results.shown import Items
from kerrcaustics.results.units import as_in


def record(result: Any, *, camera: Any = None, points: bool = False) -> dict[str, Any]:
    """A result as plain data that JSON can hold.

    Parameters
    ----------
    result
        A result of any function of this package.
    camera : Camera, optional
        Its place and motion are added; for results that do not hold their camera.
    points : bool
        True to include the points of curves.

    Returns
    -------
    dict
        The schema, and the quantities; the unit of an angle is the end of its name: _deg or _rad.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.record(kc.Camera(spin=0.9, radius=10))["inclination_deg"]
    90.0
    """
    check_result(result)
    if not isinstance(points, bool | np.bool_):
        raise ValueError(f"Argument `points` must be True or False, but is {' '.join(f'{points!r:.80}'.split())}.")
    if camera is not None and type(camera).__name__ not in ("Camera", "Observer"):
        raise ValueError(f"Argument `camera` must be a Camera or an Observer, but is {type(camera).__name__}.")
    place = {} if camera is None else _entries(camera, False)
    return {"schema": LAYOUTS[type(result)].schema, **place, **_entries(result, points)}


def check_result(result: Any) -> None:
    """Raise ValueError unless `result` is a result."""
    if type(result) not in LAYOUTS:
        raise ValueError(f"Argument `result` must be a result of kerrcaustics, but is {type(result).__name__}.")


def in_degrees(angle: float) -> float:
    """An angle (radians) that the user gave in degrees, converted back: fifteen digits, so that 60 stays 60."""
    return float(f"{math.degrees(angle):.15g}")


def _entries(result: Any, points: bool) -> dict[str, Any]:
    layout = LAYOUTS.get(type(result))
    if layout is None:
        raise ValueError(
            f"Argument `result` must hold results alone, but holds {type(result).__name__}: a class of your own needs "
            'the decorator `kerrcaustics.results.declared.result("name/1")`.'
        )
    about = {name: as_in(result, each) for name, each in quantities(type(result)).items()}
    entry: dict[str, Any] = {}
    for name in layout.names + layout.points * points:
        key, constant, text = name.partition("=")
        entry |= {key: text} if constant else _named(about[name], getattr(result, name), points)
    if layout.rows:
        columns = [(about[n], getattr(result, n)) for n in layout.rows if getattr(result, n) is not None]
        rows = [{k: v for column in columns for k, v in _row(*column, i)} for i in range(len(columns[0][1]))]
        entry[f"{columns[0][0].dims[0]}s"] = rows
    return entry


def _row(about: Quantity, values: Any, i: int) -> Any:
    one = values[i]
    if about.dims[1:] == ("morse_index",):
        one = dict(enumerate(one))
    return _named(about, one, False).items()


def _named(about: Quantity, value: Any, points: bool) -> dict[str, Any]:
    """A quantity under its name, or under one name for each component; a result without a name as its entries."""
    key = about.json if about.json is not None else about.name + "_deg" * (about.unit == "rad")
    if not key:
        return _entries(value, points)
    names = key.split()
    if len(names) > 1:
        parts = zip(names, np.moveaxis(np.asarray(value), -1, 0), strict=True)
        return {name: _plain(part, _number(about, name), points) for name, part in parts}
    return {key: _plain(value, _number(about, key), points)}


def _number(about: Quantity, key: str) -> Callable[[float], float]:
    """The conversion of numbers of a quantity under a name in a record."""
    return (in_degrees if about.given else math.degrees) if key.endswith("_deg") else float


def _plain(value: Any, number: Callable[[float], float], points: bool) -> Any:
    """A value as plain data, numbers that are not whole converted."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if type(value) in LAYOUTS and not isinstance(value, Items):
        return _entries(value, points)
    if isinstance(value, dict):
        return {str(key): _plain(part, number, points) for key, part in value.items()}
    if isinstance(value, list | tuple | Items):
        return [_plain(part, number, points) for part in value]
    if isinstance(value, float):
        return number(value) if math.isfinite(value) else None
    return value if isinstance(value, int | str | None) else str(value)
