"""The table of hard sources says truly what makes each of them hard."""

import math

import numpy as np
import problems
import pytest

import kerrcaustics as kc
from kerrcaustics.beams.ends import Sphere, end_of

# Of a caustic on which a point lies, the points are as close as this to it (radians, or M in the plane).
ON_POINT = 1e-3


def distances(problem):
    """The least and the largest distance of each caustic of the orders searched from a disc's centre, in its radii."""
    curves = kc.caustics(problem.viewer, problem.max_index + 1, end=problem.end)
    surface, size = end_of(problem.viewer, problem.end), problem.size or ON_POINT
    if isinstance(surface, Sphere) and problem.size:
        size /= problem.end
    centre = surface.vectors(np.array([problem.place]))
    for curve in curves:
        away = np.linalg.norm(surface.vectors(curve.place) - centre, axis=1)
        away = away if isinstance(surface, kc.EquatorialPlane) else 2 * np.arcsin(away / 2)
        yield away.min() / size, away.max() / size


def viewer_or_source_moves(problem):
    """As the word "moving" has it; the cameras of the table that circle are not called so."""
    velocity = getattr(problem.viewer, "velocity", "fiducial")
    return not isinstance(velocity, str) and math.hypot(*velocity) >= 0.1


def test_every_problem_has_words_of_the_list_and_every_word_has_problems():
    every = {f"{table} {name}": p for table, rows in problems.TABLES.items() for name, p in rows.items()}
    assert {name: p.why for name, p in every.items() if not p.tags or p.tags - set(problems.WHY)} == {}
    assert set().union(*(p.tags for p in every.values())) == set(problems.WHY)


@pytest.mark.slow
def test_words_hold_of_discs_and_points():
    wrong = {}
    for name, problem in (problems.DISCS | problems.POINTS | problems.SMALL).items():
        gaps = list(distances(problem))
        holds = {
            "fold": any(least < 1 < most for least, most in gaps),
            "ring": any(most < 1 for _, most in gaps),
            "far": 500 <= getattr(problem.viewer, "radius", 0.0) < math.inf,
            "moving": viewer_or_source_moves(problem),
        }
        if {word for word, true in holds.items() if true} != problem.tags & set(holds):
            wrong[name] = holds, gaps
    assert wrong == {}


def test_bodies_move_or_their_viewers_do():
    wrong = [
        name
        for name, problem in problems.BODIES.items()
        if ("moving" in problem.tags) != (problems.in_motion(problem) or viewer_or_source_moves(problem))
    ]
    assert wrong == []
