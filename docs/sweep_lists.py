"""The lists of docs/sweeps.md: the keys of a sweep file, and the variables of a store.

python docs/sweep_lists.py
"""

from typing import get_args

from scene_keys import key_table

from kerrcaustics.sweeps.quantities import variables
from kerrcaustics.sweeps.scene import Quantity, Scene


def variable_table() -> str:
    """Return the variables of each quantity in Markdown; errors, named like what they belong to, are left out."""
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
    """Return the keys of a sweep file in Markdown."""
    return key_table(Scene)


if __name__ == "__main__":
    print(scene_table(), variable_table(), sep="\n\n")
