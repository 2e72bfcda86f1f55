"""A step of the Runge-Kutta-Nystroem pair 12(10) for several second-order paths and a first-order angle each."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from kerrcaustics.beams.integrator import tableau
from kerrcaustics.beams.ray_state import Path
from kerrcaustics.spacetime.arrays import Reals

Positions = list[tuple[Reals, ...]]
Rates = Callable[[Positions], tuple[Positions, list[Reals]]]
# Numbers of all paths, or of all stages, one below the other.
_Rows = Float[Array, "_ ..."]


def nystroem_step(
    rates: Rates, paths: tuple[Path, ...], h: Reals, watched: Sequence[int] = (0,)
) -> tuple[tuple[Path, ...], list[Path]]:
    """The paths after a step, and the local errors of the watched ones, each as a Path.

    Parameters: rates, from the positions of all paths to their second derivatives and to the first derivatives of
    their angles; h, the step, one for each entry of the arrays.

    Errors: of order 12; the local error returned is the order 12 minus the order 10 result.
    """
    # All paths in one array, and the stages in a loop: written out they would compile many times as long.
    position = jnp.stack([x for path in paths for x in path.position])
    rate = jnp.stack([x for path in paths for x in path.rate])
    psi, h = jnp.stack([path.psi for path in paths]), jnp.asarray(h)
    nodes, stages = jnp.asarray(tableau.NODES), jnp.asarray(_STAGES)

    def evaluated(stage: Array, slopes: tuple[_Rows, _Rows]) -> tuple[_Rows, _Rows]:
        moved = position + h * nodes[stage] * rate + h * h * _weighted(stages[stage], slopes[0])
        accelerations, psi_rates = rates(_split(moved, paths))
        stage_slopes = [x for pulls in accelerations for x in pulls], psi_rates
        pulls, psi_rates = (rows.at[stage].set(jnp.stack(one)) for rows, one in zip(slopes, stage_slopes, strict=True))
        return pulls, psi_rates

    none = jnp.zeros((len(_STAGES), *position.shape)), jnp.zeros((len(_STAGES), *psi.shape))
    pulls, psi_rates = jax.lax.fori_loop(0, len(_STAGES), evaluated, none)
    after = _paths(
        position + h * rate + h * h * _weighted(_POSITION, pulls),
        rate + h * _weighted(_VELOCITY, pulls),
        psi + h * _weighted(_VELOCITY, psi_rates),
        paths,
    )
    gaps = _paths(
        h * h * _weighted(_POSITION - _EMBEDDED_POSITION, pulls),
        h * _weighted(_VELOCITY - _EMBEDDED_VELOCITY, pulls),
        h * _weighted(_VELOCITY - _EMBEDDED_VELOCITY, psi_rates),
        paths,
    )
    return after, [gaps[i] for i in watched]


def _weighted(weights: Any, slopes: _Rows) -> Array:
    """The sum over the stages, which stand first."""
    return jnp.tensordot(weights, slopes, axes=1, precision=jax.lax.Precision.HIGHEST)


def _split(rows: _Rows, like: tuple[Path, ...]) -> Positions:
    """Rows of an array as the components of paths."""
    ends = np.cumsum([len(path.position) for path in like])
    return [
        tuple(rows[end - len(path.position) + i] for i in range(len(path.position)))
        for path, end in zip(like, ends, strict=True)
    ]


def _paths(position: _Rows, rate: _Rows, psi: _Rows, like: tuple[Path, ...]) -> tuple[Path, ...]:
    return tuple(map(Path, _split(position, like), _split(rate, like), psi))


def _dense(weights: dict[int, float]) -> np.ndarray:
    """Weights of all stages."""
    return np.array([weights.get(stage, 0.0) for stage in tableau.STAGES])


_STAGES = np.array([_dense(weights) for weights in tableau.STAGES.values()])
_POSITION, _VELOCITY = _dense(tableau.POSITION), _dense(tableau.VELOCITY)
_EMBEDDED_POSITION, _EMBEDDED_VELOCITY = _dense(tableau.EMBEDDED_POSITION), _dense(tableau.EMBEDDED_VELOCITY)
