"""Sweeps over spin, radius and inclination, kept in one store that survives interruptions."""

from kerrcaustics.extras import require

require("sweep", "zarr")
