"""Limits of Newton's method on the sky map, for the search in NumPy and for the kernels that take its place."""

# Wanted error of the beams, radians, in the plane relative to the radius.
TOLERANCE = 1e-12
# The part of a Newton step below which a search is given up.
SHORTEST_PART = 1e-4
# A residual below so many errors of the beam is round-off.
ERRORS = 2.0
# One below so many may be, where no step makes it smaller.
MOST_ERRORS = 10.0
# How much larger than a full step before predicts the residual after another may be.
SAFETY = 100.0
# The least that it is taken for, in units of the square of the residual before by that of the minor diameter.
CURVING = 30.0

# Below this distance from the shadow edge, reach exp(-DEEPEST), a direction in double precision has no digits left.
DEEPEST = 32.0
# Closer to the shadow edge (radians) than this nothing is distinguished.
NEAREST = 1e-15
# Steps run along the shadow edge where depth is larger than this.
DEEP = 0.3
# The longest of them in angle (radians), and in depth.
LONGEST_TURN, LONGEST_DEPTH = 0.5, 1.0
# So short (radians) that a great circle leaves the edge by less than round-off.
STRAIGHT = 1e-8
# Longest step elsewhere, radians.
LONGEST = 0.3

# State of a search that goes on.
GOING = 0.0
# State of a search that has found its image.
FOUND = 1.0
# State of a search that has failed.
LOST = 2.0
# State of a search that came to a beam that the closed form does not give.
UNSURE = 3.0
