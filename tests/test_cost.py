"""Work that is left out is not paid for: counted as operations of the programs, not timed."""

from functools import cache, partial

import jax
import numpy as np
import pytest
from marks import few

from kerrcaustics.beams.closed_form import formula
from kerrcaustics.beams.integrator import integrated
from kerrcaustics.beams.kernels.programs import graph_of
from kerrcaustics.beams.ray_end import RayOutputs
from kerrcaustics.beams.traced_ends import TracedSky
from kerrcaustics.spacetime.camera import Camera

pytestmark = pytest.mark.usefixtures("compiled_code")

FRAME = Camera(0.999, 6.03).frame()
SKY = tuple(np.full(64, part) for part in (-0.6, 0.0, 0.8))
# What each asks for more than the one before.
STEPS = ("beams", "index", "crossings", "time")
# Operations that each adds, as a part of those before; of a loop's body, once. Measured with JAX 0.10.
ADDED = {
    "closed-form": {"beams": 0.75, "index": 1.0e-2, "crossings": 1.8e-2, "time": 0.130},
    "integrated": {"beams": 0.72, "index": 4.6e-2, "crossings": 5.4e-3, "time": 0.084},
}


@cache
def operations(engine: str, outputs: tuple[str, ...]) -> float:
    """Floating-point operations of the program that computes some outputs, as JAX counts them."""
    flags = {name: name in outputs for name in STEPS}
    if engine == "closed-form":
        program = partial(formula.trace, outputs=RayOutputs(**flags), on_equator=True)
        lowered = jax.jit(program).lower(FRAME, SKY, TracedSky())
    else:
        program = partial(integrated.trace, outputs=RayOutputs(**flags))
        lowered = jax.jit(program).lower(FRAME, SKY, np.ones(64), 1e-10, TracedSky())
    return lowered.cost_analysis()["flops"]


@pytest.mark.parametrize("step", few(STEPS, ("beams",)))
@pytest.mark.parametrize("engine", ["closed-form", pytest.param("integrated", marks=pytest.mark.slow)])
def test_what_is_not_asked_for_is_not_computed(engine, step):
    before = STEPS[: STEPS.index(step)]
    added = operations(engine, (*before, step)) / operations(engine, before) - 1
    # Another version of JAX counts a little differently.
    assert added > 0.7 * ADDED[engine][step]


@pytest.mark.parametrize(
    ("engine", "rays"), [("closed-form", 2.0), pytest.param("integrated", 1.8, marks=pytest.mark.slow)]
)
def test_a_beam_costs_no_more_than_so_many_rays(engine, rays):
    """JTFT have about 3."""
    assert operations(engine, ("beams",)) < rays * operations(engine, ())


@pytest.mark.slow
@pytest.mark.parametrize(("place", "part"), [("sky", 0.52), ("sphere", 0.65), ("plane", 0.67)])
def test_an_integrated_ray_costs_a_part_of_its_beam(place, part):
    """Operations of the kernels, of a step once: rays in long steps have nothing else, and cost least."""
    rays, beams = (len(graph_of(f"integrated_{kind}_{place}")[0].graph.nodes) for kind in ("rays", "beams"))
    assert rays < part * beams
