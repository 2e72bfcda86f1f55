"""Differences of two tracings of the same beams."""

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.spacetime.sphere import polar_basis


def columns_in_space(beams: Beams) -> np.ndarray:
    """The Jacobian's columns as vectors (n, 3, 2): near a pole, e_theta' itself turns by the error of n'."""
    basis = np.stack(polar_basis(beams.direction), axis=-1)
    return basis @ beams.jacobian


def relative_gap(beams: Beams, exact: Beams, end) -> np.ndarray:
    """Difference of Jacobians (n,) over delta_plus: as vectors in space, in the plane as they are."""
    if isinstance(end, EquatorialPlane):
        return np.linalg.norm(beams.jacobian - exact.jacobian, axis=(1, 2)) / exact.delta_plus
    return np.linalg.norm(columns_in_space(beams) - columns_in_space(exact), axis=(1, 2)) / exact.delta_plus
