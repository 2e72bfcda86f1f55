"""Digests of the clips and pictures in docs, and of the code that draws each: `python docs/media_digests.py NAME ...`.

docs/media.json has both for every file. Run this for a file that was made anew, or that was compared with its script
after a change that does not alter it: the names are those of the files without their endings.
"""

import ast
import hashlib
import json
import re
import sys
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

HOME = Path(__file__).resolve().parents[1]
RECORD = HOME / "docs" / "media.json"
FOLDERS = ("docs/clips", "docs/images")
# Each file by its name, and what draws it: a script, or a definition in a module ("path:name"); of a page, the code
# before the picture; another file as it is.
DRAWN_BY = {
    "pair_creation.mp4": ["figures/films/pair_creation.py"],
    "descent.mp4": ["figures/films/descent.py"],
    "finite_star.mp4": ["figures/films/finite_star.py"],
    "mapping.mp4": ["figures/films/mapping.py"],
    "galactic_plane.mp4": ["figures/films/galactic_plane.py"],
    "star_field.mp4": ["kerrcaustics/scene_files/templates/star_field.toml"],
    "front_caustics.png": ["docs/make_media.py:front_caustics", "kerrcaustics/draw/sky_results.py:caustic_set"],
    "front_tubes.png": ["docs/make_media.py:front_tubes", "figures/space_caustic_tubes.py"],
    "count_map_r2.6.png": ["figures/count_map.py"],
    "disk_caustics.png": ["figures/disk_caustics.py"],
    "photon_ring_ladder.png": ["figures/photon_ring_ladder.py"],
    "tracks_r6.03.png": ["kerrcaustics/draw/track_figure.py"],
    "scene_file.png": ["docs/scene_files.md"],
    "scene_film.webp": ["docs/scene_files.md"],
    "sweep_circuits.png": ["docs/sweeps.md"],
    "explorer.png": ["kerrcaustics/explorer/page/index.html", "kerrcaustics/explorer/page/explorer.css"],
    "accuracy.png": ["studies/accuracy/main.py:draw"],
    "astroids.png": ["studies/astroids/main.py:picture"],
    "cost.png": ["studies/cost/picture.py:draw"],
    "disk_checks.png": ["studies/disk_checks/main.py:picture"],
    "error_time.png": ["studies/error_time/picture.py:draw"],
    "far_camera.png": ["studies/far_camera/picture.py:picture"],
    "inclination.png": ["studies/inclination/main.py:picture"],
    "near_sources.png": ["studies/near_sources/main.py:picture"],
    "open_questions.png": ["studies/open_questions/main.py:draw"],
    "orders.png": ["studies/orders/main.py:picture"],
    "spin_radius.png": ["studies/spin_radius/main.py:picture"],
    "stability.png": ["studies/stability/picture.py:picture"],
}
# Modules whose definitions are followed; what is computed elsewhere, tests compare with the truth.
_FOLLOWED = ("kerrcaustics/draw/", "figures/", "studies/", "docs/")
# Parts of a program that change nothing in a picture, or differ between versions of Python.
_LEFT_OUT = {"ctx", "kind", "type_comment", "type_params", "type_ignores"}


class _Module(NamedTuple):
    """The definitions of a module by name, and the modules and names that it imports: (path, name or None)."""

    definitions: dict[str, ast.stmt]
    imports: dict[str, tuple[str, str | None]]


@lru_cache
def _module(home: Path, path: str) -> _Module:
    tree = _stripped(ast.parse((home / path).read_text(encoding="utf-8")))
    found = _Module({}, {})
    for statement in tree.body:
        if isinstance(statement, ast.FunctionDef | ast.ClassDef):
            found.definitions[statement.name] = statement
        elif isinstance(statement, ast.ImportFrom):
            for alias in statement.names:
                found.imports[alias.asname or alias.name] = _place(home, path, statement, alias.name)
        elif isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            for name in (node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name)):
                found.definitions[name] = statement
    return found


def _stripped(tree: ast.Module) -> ast.Module:
    """A program without docstrings and annotations."""
    for node in ast.walk(tree):
        for name in ("annotation", "returns"):
            if hasattr(node, name):
                setattr(node, name, None)
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and ast.get_docstring(node, clean=False) is not None:
            del node.body[0]
    return tree


def _place(home: Path, path: str, statement: ast.ImportFrom, name: str) -> tuple[str, str | None]:
    """The module that an import loads, or the module and the name in it."""
    folder = Path(path).parents[statement.level - 1].as_posix() + "/" if statement.level else ""
    base = folder + (statement.module or "").replace(".", "/")
    inside = f"{base.rstrip('/')}/{name}.py"
    return (inside, None) if (home / inside).is_file() else (f"{base}.py", name)


def _reached(home: Path, path: str, name: str | None) -> dict[tuple[str, str], ast.stmt]:
    """The definitions that a script, or a definition of a module, is made of."""
    names = [name] if name else list(_module(home, path).definitions)
    waiting, reached = [(path, each) for each in names], {}
    while waiting:
        place = waiting.pop()
        path, name = place
        if place in reached or not (path.startswith(_FOLLOWED) and (home / path).is_file()):
            continue
        module = _module(home, path)
        if name in module.definitions:
            reached[place] = module.definitions[name]
            waiting += [(path, each.id) for each in ast.walk(reached[place]) if isinstance(each, ast.Name)]
            waiting += _attributes(module, reached[place])
        elif name in module.imports and module.imports[name][1]:
            waiting.append(module.imports[name])
    return reached


def _attributes(module: _Module, statement: ast.stmt) -> list[tuple[str, str]]:
    """Names in imported modules that a definition uses, as in `style.RC`."""
    used = [node for node in ast.walk(statement) if isinstance(node, ast.Attribute)]
    pairs = [(module.imports.get(getattr(node.value, "id", ""), ("", "")), node.attr) for node in used]
    return [(path, attribute) for (path, name), attribute in pairs if name is None]


def _plain(node: Any) -> str:
    """A definition as text, without its layout."""
    if isinstance(node, list):
        return f"[{','.join(map(_plain, node))}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = {name: value for name, value in ast.iter_fields(node) if name not in _LEFT_OUT and value not in (None, [])}
    return f"{type(node).__name__}({','.join(f'{name}={_plain(value)}' for name, value in fields.items())})"


def drawing_digest(roots: list[str], picture: str = "", home: Path = HOME) -> str:
    """A digest of what draws a picture."""
    hashed = hashlib.sha256()
    for root in roots:
        path, _, name = root.partition(":")
        if path.endswith(".py"):
            reached = _reached(home, path, name or None)
            parts = [f"{where}:{what} {_plain(reached[where, what])}" for where, what in sorted(reached)]
        else:
            parts = [(home / path).read_text(encoding="utf-8")]
        if path.endswith(".md"):
            parts = [code_before(parts[0], picture)]
        hashed.update("\n".join(parts).encode())
    return hashed.hexdigest()


def code_before(page: str, picture: str) -> str:
    """The last block of code before a picture of a page."""
    return re.findall(r"```\w+\n(.*?)```", page[: page.index(f"images/{picture}")], re.DOTALL)[-1]


def media() -> dict[str, Path]:
    """The clips and pictures by name."""
    return {path.name: path for folder in FOLDERS for path in sorted((HOME / folder).iterdir())}


def digests(name: str) -> dict[str, str]:
    """The digest of a file, and that of what draws it."""
    content = hashlib.sha256(media()[name].read_bytes()).hexdigest()
    return {"file": content, "drawn_by": drawing_digest(DRAWN_BY[name], name)}


def recorded() -> dict[str, dict[str, str]]:
    """The digests in docs/media.json."""
    return json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}


def record(stems: list[str]) -> None:
    """Write the digests of the files of some names, of all if there are none."""
    chosen = [name for name in DRAWN_BY if not stems or Path(name).stem in stems]
    if missing := set(stems) - {Path(name).stem for name in chosen}:
        sys.exit(f"There is no clip and no picture {', '.join(sorted(missing))}")
    found = {**recorded(), **{name: digests(name) for name in chosen}}
    RECORD.write_text(json.dumps(dict(sorted(found.items())), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    record(sys.argv[1:])
