"""The engine in closed form: elliptic integrals for r, theta functions for theta and phi."""
