"""The keys of a sweep file, and the variables of a store, in Markdown."""

from typing import get_args

from kerrcaustics.scene_files.key_tables import key_table
from kerrcaustics.sweeps.quantities import variables
from kerrcaustics.sweeps.scene import Quantity, Scene


def variable_table() -> str:
    """The variables of each quantity in Markdown; errors, named like what they belong to, are left out."""
    rows = ["| compute | variable | further dimensions | units | meaning |", "|---|---|---|---|---|"]
    for quantity in get_args(Quantity):
        found = variables(Scene(spin=0.5, radius=6.0, compute=(quantity,)))
        names = {one.name for one in found}
        for one in found:
            if one.name.removesuffix("_error") not in names - {one.name}:
                dims = ", ".join(f"`{name}`" for name in one.dims)
                rows.append(f"| `{quantity}` | `{one.name}` | {dims} | {one.unit} | {one.text} |")
    return "\n".join(rows)


def scene_table() -> str:
    """The keys of a sweep file in Markdown."""
    return key_table(Scene)
