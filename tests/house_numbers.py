"""Numbers of the house: what a reader meets, counted. `.venv/bin/python tests/house_numbers.py` prints them.

tests/test_house.py lets none of them grow.
"""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from test_layers import ENTRY_POINTS, FLOORS

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "kerrcaustics"
SURFACES = {"CelestialSphere", "Sphere", "EquatorialPlane", "Spherical", "Spheres"}
DOMAINS = {"OneLeaf", "TwoLeaves", "Ring"}
# One word that is a preposition, an adverb, a quantifier or a bare participle of a vague verb: no name of a function,
# unless it returns a flag.
PARTICLES = re.compile(
    r"_?(at|of|on|in|to|by|from|with|for|about|around|near|between|beside|before|after|into|beyond|within|across|along"
    r"|ahead|whole|together|apart|again|here|there|alone|once|every|all|both|none|one|same|like|left"
    r"|turned|seen|told|found|asked|shown|known|given|brought|taken|made|done|said|looked|held|kept|gone|wanted|called"
    r"|put|lit|begun|chosen|judged|touched|crossed|lived|searched|counted|traced|measured|followed)"
)
FLAGS = re.compile(r"bool|Bool\[|Flags")


class Module(NamedTuple):
    """A module: its path in the package, its room, its lines, its tree and all nodes of that."""

    path: Path
    room: str
    lines: list[str]
    tree: ast.Module
    nodes: list[ast.AST]


def modules() -> Iterator[Module]:
    """The modules of the package."""
    for path in sorted(PACKAGE.rglob("*.py")):
        inside, text = path.relative_to(PACKAGE), path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        yield Module(inside, inside.with_suffix("").parts[0], text.splitlines(), tree, list(ast.walk(tree)))


def floor_of(room: str) -> int:
    """The number of the floor of a room, from 0; -1 for an entry point."""
    return -1 if room in ENTRY_POINTS else next(n for n, rooms in enumerate(FLOORS.values()) if room in rooms)


def imported_rooms(module: Module) -> set[str]:
    """The rooms from which a module imports, also inside its functions."""
    names = []
    for node in module.nodes:
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return {(name + ".").split(".")[1] for name in names if name.split(".")[0] == "kerrcaustics"} - {""}


def upward_imports(module: Module) -> list[str]:
    """Imports that run up a floor."""
    if module.room in ENTRY_POINTS:
        return []
    rooms = imported_rooms(module) - ENTRY_POINTS
    return [f"{module.path}: {room}" for room in sorted(rooms) if floor_of(room) > floor_of(module.room)]


def class_tests(module: Module, classes: set[str]) -> list[str]:
    """Calls of `isinstance` that ask for one of some classes."""
    calls = [node for node in module.nodes if isinstance(node, ast.Call) and len(node.args) == 2]
    asked = [node for node in calls if getattr(node.func, "id", "") == "isinstance"]
    return [
        f"{module.path}:{node.lineno}"
        for node in asked
        if classes & {part.id for part in ast.walk(node.args[1]) if isinstance(part, ast.Name)}
    ]


def ray_calls(module: Module) -> list[str]:
    """Calls that trace rays or beams by the engine."""
    names = {"trace_rays", "trace_beams", "beams_of_directions", "rays_of_directions"}
    calls = [node for node in module.nodes if isinstance(node, ast.Call)]
    return [f"{module.path}:{call.lineno}" for call in calls if getattr(call.func, "id", "") in names]


def is_record(node: ast.ClassDef) -> bool:
    """True for dataclasses and named tuples."""
    words = [ast.unparse(part) for part in (*node.decorator_list, *node.bases)]
    return any(re.search("dataclass|NamedTuple", word) for word in words)


def packed_records(module: Module) -> list[str]:
    """Records that describe several fields in one sentence; sections in NumPy form have an entry for each."""
    found = []
    for node in module.nodes:
        if isinstance(node, ast.ClassDef) and is_record(node):
            parts = (ast.get_docstring(node) or "").split("\n\n")
            if any(part.count(";") >= 2 for part in parts if not re.match(r"\w+\n-{3,}\n", part)):
                found.append(f"{module.path}: {node.name}")
    return found


def constant_tuples(module: Module) -> list[str]:
    """Assignments of three or more constants at once."""
    return [
        f"{module.path}:{node.lineno}"
        for node in module.tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Tuple)
        and len(node.targets[0].elts) >= 3
        and all(isinstance(name, ast.Name) and name.id.isupper() for name in node.targets[0].elts)
    ]


def functions_of(module: Module) -> Iterator[ast.FunctionDef]:
    """All functions and methods."""
    for node in module.nodes:
        if isinstance(node, ast.FunctionDef):
            yield node


def particle_names(module: Module) -> list[str]:
    """Functions that are named by a particle or a participle alone, but for those that return flags."""
    named = [function for function in functions_of(module) if PARTICLES.fullmatch(function.name)]
    return [f"{module.path}: {f.name}" for f in named if not (f.returns and FLAGS.match(ast.unparse(f.returns)))]


def shared_class_names(every: list[Module]) -> list[str]:
    """Names of classes in two rooms."""
    homes = Counter()
    for name in {(node.name, m.room) for m in every for node in m.nodes if isinstance(node, ast.ClassDef)}:
        homes[name[0].lstrip("_")] += 1
    return sorted(name for name, count in homes.items() if count > 1)


def code_lines(module: Module) -> int:
    """Lines that are neither blank, nor comments, nor docstrings."""
    without = set()
    for node in module.nodes:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            without |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return sum(
        bool(line.strip()) and not line.strip().startswith("#") and number not in without
        for number, line in enumerate(module.lines, 1)
    )


def numbers() -> dict[str, list[str] | int]:
    """All of them: lists of places, or counts."""
    every = list(modules())
    pages = [path for path in (ROOT / "docs").rglob("*.md") if "_build" not in path.parts]
    return {
        "imports that run up a floor": [one for m in every for one in upward_imports(m)],
        "isinstance on surfaces outside beams": [
            one for m in every if m.room != "beams" for one in class_tests(m, SURFACES)
        ],
        "isinstance on domains outside lens_map": [
            one for m in every if m.room != "lens_map" for one in class_tests(m, DOMAINS)
        ],
        "extended and moving sources that import tracks": [
            str(m.path)
            for m in every
            if m.room in ("extended_sources", "light_curves") and "tracks" in imported_rooms(m)
        ],
        "calls of the engine outside beams and lens_map": [
            one for m in every if m.room not in ("beams", "lens_map") and floor_of(m.room) == 2 for one in ray_calls(m)
        ],
        "records with several fields in a sentence": [one for m in every for one in packed_records(m)],
        "assignments of three constants or more": [one for m in every for one in constant_tuples(m)],
        "functions named by a particle": [one for m in every for one in particle_names(m)],
        "class names in two rooms": shared_class_names(every),
        "code lines of the package": sum(map(code_lines, every)),
        "words under docs": sum(len(page.read_text(encoding="utf-8").split()) for page in pages),
        "pages under docs": len(pages),
    }


def main() -> None:
    """Print the numbers, and the places of the shorter lists."""
    for name, value in numbers().items():
        count = value if isinstance(value, int) else len(value)
        print(f"{name}: {count:,}")
        if isinstance(value, list) and len(value) <= 25:
            print("".join(f"    {one}\n" for one in value), end="")


if __name__ == "__main__":
    main()
