"""One step of the Runge-Kutta-Nystroem pair 12(10) for several second-order paths and a first-order angle each."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from kerrcaustics.beams.integrator import tableau
from kerrcaustics.spacetime.arrays import Reals


class Path(NamedTuple):
    """A point of a path, or of its variation: position (several components), its rate, and an angle psi.

    The position obeys a second-order equation, psi a first-order one; neither right-hand side holds the rate.
    """

    position: tuple[Reals, ...]
    rate: tuple[Reals, ...]
    psi: Reals


Positions = list[tuple[Reals, ...]]
Rates = Callable[[Positions], tuple[Positions, list[Reals]]]


def nystroem_step(
    rates: Rates, paths: tuple[Path, ...], h: Reals, watched: Sequence[int] = (0,)
) -> tuple[tuple[Path, ...], list[Path]]:
    """The paths one step later, and the local errors of the watched ones, each as a Path.

    Parameters: rates, from the positions of all paths to their second derivatives and to the first derivatives of
    their angles; h, the step, one for each entry of the arrays.

    Errors: of order 12; the local error returned is the order 12 minus the order 10 result.
    """
    accelerations: list[Positions] = []
    psi_rates: list[list[Reals]] = []

    def weighted(weights: dict[int, float], path: int, i: int) -> Reals:
        return sum(weight * accelerations[stage - 1][path][i] for stage, weight in weights.items())

    def weighted_psi(weights: dict[int, float], path: int) -> Reals:
        return sum(weight * psi_rates[stage - 1][path] for stage, weight in weights.items())

    def moved(time: Reals, weights: dict[int, float]) -> Positions:
        """Positions after a time, along the rate and the weighted accelerations."""
        return [
            tuple(
                path.position[i] + time * path.rate[i] + (h * h * weighted(weights, p, i) if weights else 0)
                for i in range(len(path.position))
            )
            for p, path in enumerate(paths)
        ]

    for node, weights in zip(tableau.NODES, tableau.STAGES.values(), strict=True):
        acceleration, psi_rate = rates(moved(h * node, weights))
        accelerations.append(acceleration)
        psi_rates.append(psi_rate)
    after = tuple(
        Path(
            position=position,
            rate=tuple(r + h * weighted(tableau.VELOCITY, p, i) for i, r in enumerate(path.rate)),
            psi=path.psi + h * weighted_psi(tableau.VELOCITY, p),
        )
        for p, (path, position) in enumerate(zip(paths, moved(h, tableau.POSITION), strict=True))
    )
    errors = [
        Path(
            position=tuple(h * h * weighted(_POSITION_GAP, p, i) for i in range(len(paths[p].position))),
            rate=tuple(h * weighted(_VELOCITY_GAP, p, i) for i in range(len(paths[p].position))),
            psi=h * weighted_psi(_VELOCITY_GAP, p),
        )
        for p in watched
    ]
    return after, errors


def _gap(high: dict[int, float], low: dict[int, float]) -> dict[int, float]:
    return {stage: high.get(stage, 0.0) - low.get(stage, 0.0) for stage in high | low}


_POSITION_GAP = _gap(tableau.POSITION, tableau.EMBEDDED_POSITION)
_VELOCITY_GAP = _gap(tableau.VELOCITY, tableau.EMBEDDED_VELOCITY)
