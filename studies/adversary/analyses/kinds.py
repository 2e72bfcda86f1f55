"""The kinds of analyses: what the modules beside this one call KINDS, all together."""

import pkgutil
from importlib import import_module
from pathlib import Path

from .claim import Kind


def all_kinds() -> dict[str, Kind]:
    """Kinds by name, in the order of the names of their modules; a name stands for one kind."""
    found: dict[str, Kind] = {}
    for module in sorted(one.name for one in pkgutil.iter_modules([str(Path(__file__).parent)])):
        # The command imports this module.
        if module == "__main__":
            continue
        kinds: dict[str, Kind] = getattr(import_module(f".{module}", __package__), "KINDS", {})
        twice = found.keys() & kinds.keys()
        if twice:
            raise ValueError(f"Module {module} has kinds that another module has, too: {', '.join(sorted(twice))}.")
        found |= kinds
    return found


def chosen_kinds(names: str) -> dict[str, Kind]:
    """Kinds by their names with commas between them, or "all"."""
    kinds = all_kinds()
    wanted = list(kinds) if names == "all" else names.split(",")
    unknown = [name for name in wanted if name not in kinds]
    if unknown:
        raise ValueError(f"There is no kind {', '.join(unknown)}; there are {', '.join(kinds)}.")
    return {name: kinds[name] for name in wanted}
