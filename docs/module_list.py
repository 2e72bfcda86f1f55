"""The list of modules in docs/architecture.md: the first sentence of each docstring, by folder.

python docs/module_list.py
"""

import ast
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "kerrcaustics"


def summary(module: Path) -> str:
    """Return the first paragraph of a module's docstring, on one line."""
    text = ast.get_docstring(ast.parse(module.read_text(encoding="utf-8"))) or ""
    return " ".join(text.partition("\n\n")[0].split())


def module_list(package: Path = PACKAGE) -> str:
    """Return all modules of a package in Markdown, folder by folder."""
    lines = []
    for start in sorted(package.rglob("__init__.py")):
        folder = start.parent
        lines += ["", f"**`{folder.relative_to(package.parent).as_posix()}/`** {summary(start)}", ""]
        modules = sorted(path for path in folder.glob("*.py") if path != start)
        lines += [f"- `{path.name}`: {summary(path)}" for path in modules]
    return "\n".join(lines)


if __name__ == "__main__":
    print(module_list())
