"""Sweeps over spin, radius and inclination, kept in one store that survives interruptions."""
