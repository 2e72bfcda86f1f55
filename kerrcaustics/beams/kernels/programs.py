"""The list of kernels: for each a function of one ray, and arguments that say what differs from ray to ray."""

from collections.abc import Callable
from enum import Enum
from functools import partial
from importlib import import_module
from itertools import product
from types import ModuleType
from typing import Any, NamedTuple

import jax

from kerrcaustics.beams import bundle_formulas
from kerrcaustics.beams.closed_form import deep_rays, formula
from kerrcaustics.beams.integrator import integrated
from kerrcaustics.beams.kernels.lowering import Lowered, lowered
from kerrcaustics.beams.kernels.tables import Table
from kerrcaustics.beams.ray_end import RayOutputs
from kerrcaustics.beams.ray_state import Aim, Bundle, BundleState, Constants, Path
from kerrcaustics.beams.traced_ends import PLACES
from kerrcaustics.spacetime import polar
from kerrcaustics.spacetime.frame import Frame, Photon


class Number(Enum):
    """A number of an argument: one for the call, or one for each ray."""

    OF_CALL = 0.5
    OF_RAY = 0.25
    FLAG_OF_RAY = False


class Program(NamedTuple):
    """A function to be made into a kernel, and trees of `Number` and `Table` in the place of its arguments."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]


# They stand where functions have numbers.
_ONE: Any = Number.OF_CALL
_EACH: Any = Number.OF_RAY
_FLAG: Any = Number.FLAG_OF_RAY
FRAME = Frame(*[_ONE] * 11, basis=((_ONE, _ONE, _ONE),) * 3, zoom=_ONE, start=_ONE)
SKY = (_EACH,) * 3
# The numbers of ends; those of spheres are those of each ray.
ENDS: dict[str, tuple[Number, ...]] = {"sky": (), "sphere": (_EACH, _FLAG), "plane": (_ONE,)}
_FINITE, SPHERICAL = ("sphere", "plane"), ("sky", "sphere")
_YES_OR_NO = (False, True)

# A ray with its variations and its clock, as bundles hold them.
_PATH = Path((_EACH,) * 4, (_EACH,) * 4, _EACH)
_CONSTANTS = Constants(*[_EACH] * 5)
_STATE = BundleState((_PATH, _PATH, _PATH, Path((_EACH,), (_EACH,), _EACH)), _EACH, _EACH, _EACH)
_BUNDLE = Bundle(_CONSTANTS, [_CONSTANTS] * 2, _EACH, _EACH, _EACH, _FLAG, _FLAG, _EACH, _PATH)
_AIM = Aim(_FLAG, _FLAG, _EACH, _EACH, _FLAG, _FLAG, _EACH)
_FOUR = (_ONE, _ONE, _ONE, _ONE)
_PHOTON = Photon(*_FOUR, _FOUR, _FOUR, _ONE)


# Modules of other rooms that have programs: they use this one, and so have their names here.
_MODULES = (
    "kerrcaustics.lens_map.crossing_formulas",
    "kerrcaustics.lens_map.newton_formulas",
    "kerrcaustics.scenes.cell_formulas",
    "kerrcaustics.scenes.colour_formulas",
    "kerrcaustics.scenes.direction_formulas",
    "kerrcaustics.scenes.disk.emission_formulas",
    "kerrcaustics.scenes.disk.plane_formulas",
    "kerrcaustics.scenes.map_formulas",
    "kerrcaustics.scenes.sky_formulas",
    "kerrcaustics.waves.wave_formulas",
)


def programs() -> dict[str, Program]:
    """All kernels by their names."""
    of_rays = {**_of_closed_form(), **_of_short_rays(), **_of_integrator(), **_of_deep_rays(), **_of_paths()}
    return of_rays | {name: program for module in modules() for name, program in module.programs().items()}


def modules() -> list[ModuleType]:
    """Modules of other rooms whose function `programs` names kernels."""
    return [import_module(name) for name in _MODULES]


def graph_of(program: str) -> tuple[Lowered, list[bool | None]]:
    """The graph of a kernel by its name, and for each leaf of its arguments True if each ray has its own.

    None for a table.
    """
    function, arguments = programs()[program]
    by_ray = [
        None if isinstance(number, Table) else number is not Number.OF_CALL for number in jax.tree.leaves(arguments)
    ]
    return lowered(function, jax.tree.map(lambda number: number.value, arguments), by_ray), by_ray


def named(base: str, **chosen: bool) -> str:
    """A name with the words that are chosen."""
    return "_".join([base, *(word for word, is_chosen in chosen.items() if is_chosen)])


def _quantities(beams: bool, time: bool) -> RayOutputs:
    return RayOutputs(beams=beams, index=beams, crossings=beams, time=time)


def _of_closed_form() -> dict[str, Program]:
    made = {}
    for place, beams, time, equator in product(ENDS, _YES_OR_NO, _YES_OR_NO, _YES_OR_NO):
        options = {"outputs": _quantities(beams, time), "on_equator": equator}
        function = with_end(partial(formula.trace, **options), place, 2)
        name = named("beams" if beams else "rays", time=time, equator=equator)
        made[f"{name}_{place}"] = Program(function, (FRAME, SKY, ENDS[place]))
    return made


def _of_short_rays() -> dict[str, Program]:
    made = {}
    for place, beams, time in product(SPHERICAL, _YES_OR_NO, _YES_OR_NO):
        options = {"outputs": _quantities(beams, time), "on_equator": False, "short": True}
        function = with_end(partial(formula.trace, **options), place, 2)
        name = named("short_beams" if beams else "short_rays", time=time)
        made[f"{name}_{place}"] = Program(function, (FRAME, SKY, ENDS[place]))
    return made


def _of_integrator() -> dict[str, Program]:
    made = {}
    for place, beams, time in product(ENDS, _YES_OR_NO, _YES_OR_NO):
        function = with_end(partial(integrated.trace, outputs=_quantities(beams, time)), place, 4)
        name = named("integrated_beams" if beams else "integrated_rays", time=time)
        made[f"{name}_{place}"] = Program(function, (FRAME, SKY, _EACH, _ONE, ENDS[place]))
    for name, whole in (("survey", integrated.survey), ("prospects", integrated.prospects)):
        for place in ENDS if name == "survey" else _FINITE:
            made[f"{name}_{place}"] = Program(with_end(whole, place, 2), (FRAME, SKY, ENDS[place]))
    return made


def _of_deep_rays() -> dict[str, Program]:
    made = {"depth": Program(deep_rays.depth, (FRAME, SKY))}
    for place, equator in product(SPHERICAL, _YES_OR_NO):
        function = with_end(partial(deep_rays.ends, on_equator=equator), place, 3)
        made[f"{named('deep', equator=equator)}_{place}"] = Program(function, (FRAME, SKY, _EACH, ENDS[place]))
    return made


def _of_paths() -> dict[str, Program]:
    made = {
        "advanced": Program(bundle_formulas.advanced, (_ONE, _BUNDLE, _STATE, _EACH)),
        "beam_area": Program(bundle_formulas.beam_area, (_ONE, _CONSTANTS, _STATE)),
        "timed": Program(bundle_formulas.timed, (FRAME, _BUNDLE, _STATE, _FLAG)),
        "doubt": Program(bundle_formulas.doubt, (_ONE, _BUNDLE, _STATE)),
        "time_to_plane": Program(polar.mino_time_to_plane, (FRAME, _PHOTON, _EACH)),
    }
    for place, numbers in ENDS.items():
        departing = with_end(bundle_formulas.departing, place, 2)
        made[f"departing_{place}"] = Program(departing, (FRAME, SKY, numbers, _ONE))
        settled = with_end(bundle_formulas.settled, place, 2)
        made[f"settled_{place}"] = Program(settled, (_ONE, _BUNDLE, numbers, _AIM, _STATE))
        end_place = with_end(bundle_formulas.end_place, place, 2)
        made[f"end_place_{place}"] = Program(end_place, (_ONE, _BUNDLE, numbers, _AIM, _PATH))
    return made


def with_end(function: Callable[..., Any], place: str, position: int) -> Callable[..., Any]:
    """A function that takes the numbers of an end in the place of the end."""

    def function_of_numbers(*arguments: Any) -> Any:
        end = PLACES[place](*arguments[position])
        return function(*arguments[:position], end, *arguments[position + 1 :])

    return function_of_numbers
