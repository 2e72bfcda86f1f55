"""What is left out is not paid for: counted in the compiled programs, not timed."""

from functools import cache, partial
from itertools import pairwise

import jax
import jax.numpy as jnp
import pytest

from kerrcaustics.beams.calls import CLOSED_FORM_COMPILER
from kerrcaustics.beams.closed_form import formula
from kerrcaustics.beams.ends import CelestialSphere
from kerrcaustics.beams.integrator import integrated
from kerrcaustics.beams.ray_end import Wanted
from kerrcaustics.spacetime.camera import Camera

FRAME = Camera(0.999, 6.03).frame()
SKY = tuple(jnp.full(64, part) for part in (-0.6, 0.0, 0.8))
NOTHING = {"beams": False}
BEAMS = {"beams": True}
INDEX = {"beams": True, "index": True}
CROSSINGS = {"beams": True, "index": True, "crossings": True}
TIME = {"beams": True, "index": True, "crossings": True, "time": True}
# Each with one thing more than the one before.
SCENES = [NOTHING, BEAMS, INDEX, CROSSINGS, TIME]
OFF = {"index": False, "crossings": False, "time": False}
ENGINES = ["closed-form", "integrated"]


@cache
def lowered(engine: str, **wanted: bool):
    if engine == "closed-form":
        program = partial(formula.trace, wanted=Wanted(**wanted), on_equator=True)
        return jax.jit(program).lower(FRAME, SKY, CelestialSphere())
    program = partial(integrated.trace, wanted=Wanted(**wanted))
    return jax.jit(program).lower(FRAME, SKY, jnp.ones(64), 1e-10, CelestialSphere())


def steps(text: str) -> int:
    """Instructions of a program, those of each loop's body once."""
    return sum(" = " in line for line in text.splitlines())


def compiled(engine: str, **wanted: bool) -> str:
    """The program that runs, without fused loops, in which work could hide."""
    return lowered(engine, **wanted).compile(compiler_options=CLOSED_FORM_COMPILER["cpu"]).as_text()


def assert_each_costs_more(counts: list[int]) -> None:
    assert all(less < more for less, more in pairwise(counts)), counts


@pytest.mark.parametrize("engine", ["closed-form", pytest.param("integrated", marks=pytest.mark.slow)])
def test_a_scene_that_needs_less_is_a_shorter_program(engine):
    assert_each_costs_more([steps(lowered(engine, **wanted).as_text()) for wanted in SCENES])


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_a_scene_that_needs_less_is_a_shorter_compiled_program(engine):
    assert_each_costs_more([steps(compiled(engine, **wanted)) for wanted in SCENES])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scene", [NOTHING, BEAMS], ids=["rays", "beams"])
def test_what_is_off_leaves_no_trace(engine, scene):
    assert lowered(engine, **scene).as_text() == lowered(engine, **scene, **OFF).as_text()
