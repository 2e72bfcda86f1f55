"""Random cases of what is computed from beams, each held against an independent truth."""
