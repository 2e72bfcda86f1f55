"""Kernels: the formulas of beams/ as machine code, made from the same functions when the package is built."""
