"""The volume of a scene: numbers, expressions of the place, or grids from files."""

import ast
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from kerrcaustics.choices import either, suggestion
from kerrcaustics.scene_files import matter_tables
from kerrcaustics.scene_files.camera_motion import PLACE_NAMES
from kerrcaustics.scene_files.cameras import CameraPath
from kerrcaustics.scene_files.expressions import CONSTANTS, Formula, check_names, formula
from kerrcaustics.scene_files.table_values import GridTable
from kerrcaustics.scene_files.validation import SceneError, reject, table_errors
from kerrcaustics.scenes.colour import ResponseLike, from_srgb
from kerrcaustics.scenes.disk.volume import VOLUME_MOTIONS, Volume, VolumeGrid, VolumeLaw
from kerrcaustics.shapes import Float

Array = np.ndarray
Values = tuple[tuple[str, float], ...]

PLACE = ("r", "theta", "phi")
"""Names of the place in expressions of a volume: units of the mass, and radians."""

# Number of places at which a volume is evaluated before any ray is marched.
_SAMPLED = 256

_SIGNS: dict[type, Callable[[Any], Any]] = {ast.UAdd: np.positive, ast.USub: np.negative}
_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.float_power,
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "abs", "radians", "degrees")},
    "atan": np.arctan,
    "min": lambda first, *rest: _reduced(np.minimum, first, rest),
    "max": lambda first, *rest: _reduced(np.maximum, first, rest),
}


@dataclass(frozen=True, eq=False)
class SpaceLaw(VolumeLaw):
    """An expression of the place at one moment, as a function of radius, theta and azimuth.

    entry: its entry in the file.
    text: the expression.
    values: values of its names, but for the coordinates of the place.
    angle: angle by which it is turned about the spin axis, radians.
    """

    entry: str
    text: str
    values: Values
    angle: float = 0.0

    @property
    def symmetric(self) -> bool:
        """True if it is the same at all azimuths."""
        return "phi" not in {node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name)}

    @property
    def _tree(self) -> ast.expr:
        return ast.parse(self.text.strip(), mode="eval").body

    def turned_by(self, angle: float) -> "SpaceLaw":
        """The law turned about the spin axis by an angle (radians, toward larger phi)."""
        return replace(self, angle=self.angle + angle)

    def __call__(
        self, radius: Float[Array, " n"], theta: Float[Array, " n"], azimuth: Array | float = 0.0
    ) -> Float[Array, " n"]:
        """Values (n,) at places."""
        named = {**CONSTANTS, **dict(self.values), "r": radius, "theta": theta, "phi": azimuth - self.angle}
        with np.errstate(all="ignore"):
            values = np.asarray(_value(self._tree, named), float) + np.zeros_like(radius)
        wrong = ~(np.isfinite(values) & (values >= 0))
        if wrong.any() and self.entry != "volume.motion":
            i = int(np.argmax(wrong))
            place = ", ".join(f"{name} = {np.broadcast_to(named[name], wrong.shape)[i]:.6g}" for name in PLACE)
            raise SceneError(f"{self.entry} must be finite and not negative, but is {values[i]:.6g} at {place}.")
        return values


def _value(tree: ast.expr, named: dict[str, Any]) -> Any:
    """The value of an expression that `formula` has accepted, with arrays for names."""
    match tree:
        case ast.Constant(value=number):
            return float(str(number))
        case ast.Name(id=name):
            return named[name]
        case ast.UnaryOp(op=sign, operand=part):
            return _SIGNS[type(sign)](_value(part, named))
        case ast.BinOp(left=left, op=op, right=right):
            return _OPERATORS[type(op)](_value(left, named), _value(right, named))
        case ast.Call(func=ast.Name(id=name), args=parts):
            return _FUNCTIONS[name](*(_value(part, named) for part in parts))
    raise ValueError(f"{ast.unparse(tree)!r} is no expression")


def _reduced(function: Callable[[Any, Any], Any], first: Any, rest: tuple[Any, ...]) -> Any:
    for value in rest:
        first = function(first, value)
    return first


def values_in(table: matter_tables.VolumeTable, path: CameraPath, time: float) -> Values:
    """Values at a time of the names in a volume's expressions, without the coordinates of the place."""
    expressions, moment = _formulas(table), path.values_at(time)
    for name in PLACE:
        if name in path.formulas:
            reject("definitions", "have names other than r, theta and phi where there is a volume", repr(name))
    check_names(expressions, path.formulas, (*PLACE_NAMES, *PLACE))
    names = {name for expression in expressions for name in expression.names} - {*PLACE}
    return tuple((name, moment.named(name).value) for name in sorted(names))


def _formulas(table: matter_tables.VolumeTable) -> list[Formula]:
    entries = [(f"volume.{law}", getattr(table, law)) for law in ("density", "temperature")]
    if table.motion not in VOLUME_MOTIONS:
        if table.motion.strip().isidentifier():
            must = f"be {either([*VOLUME_MOTIONS, 'an expression of r and theta'])}"
            raise SceneError(
                f"volume.motion must {must}, but is {table.motion}{suggestion(table.motion, VOLUME_MOTIONS)}"
            )
        entries.append(("volume.motion", table.motion))
    expressions = [formula(entry, value) for entry, value in entries if isinstance(value, str)]
    for expression in expressions:
        if expression.entry == "volume.motion" and "phi" in expression.names:
            reject("volume.motion", "be the same all round", repr(table.motion))
    return expressions


@lru_cache(maxsize=4)
def volume_of(
    table: matter_tables.VolumeTable,
    values: Values,
    brightness: float,
    spin: float,
    folder: Path,
    files: tuple[tuple[str, str], ...],
    response: ResponseLike = "cie",
) -> Volume:
    """The volume; invalid numbers raise ValueError. values: as of `values_in`; files, response: as for `sky_of`."""
    density = _law(table, "density", values, folder)
    temperature, colour = (_law(table, name, values, folder) for name in ("temperature", "colour"))
    motion = table.motion if table.motion in VOLUME_MOTIONS else SpaceLaw("volume.motion", table.motion, values)
    with table_errors("volume"):
        rims = table.inner, table.outer
        volume = Volume(density, temperature, *rims, table.scale, motion, brightness, response, colour)
        volume.check(spin)
        parts = np.random.default_rng(0).random((3, _SAMPLED))
        radius = table.inner * (table.outer / table.inner) ** parts[0]
        volume.matter(radius, np.pi * parts[1], 2 * np.pi * parts[2], np.zeros(_SAMPLED))
    return volume


def _law(table: matter_tables.VolumeTable, name: str, values: Values, folder: Path) -> Any:
    """Density, temperature or colour; with a grid of the density, other grids are averaged by absorption."""
    law = getattr(table, name)
    if isinstance(law, str):
        if name != "colour":
            return SpaceLaw(f"volume.{name}", law, values)
        with table_errors("volume"):
            return tuple(from_srgb(law).tolist())
    if not isinstance(law, GridTable):
        return law
    entry, weights = f"volume.{name}.file", None
    grid = _array_in(folder / law.file, entry)
    if name != "density" and isinstance(table.density, GridTable):
        density = _array_in(folder / table.density.file, "volume.density.file")
        weights = density if density.shape == grid.shape[:3] else None
    with table_errors("volume", values=entry):
        return VolumeGrid(grid, table.inner, table.outer, weights)


def _array_in(path: Path, entry: str) -> Array:
    """The array of a .npy file."""
    must = "name a .npy file with an array of numbers"
    try:
        # Memory-mapped, so that a false header does not allocate memory.
        grid = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError, SyntaxError) as error:
        reason = " ".join(str(error).split())[:80]
        raise SceneError(f"{entry} must {must}, but {path.name!r}: {reason}.") from None
    if not isinstance(grid, np.ndarray):
        reject(entry, must, repr(path.name))
    return grid
