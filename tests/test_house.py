"""Rules of CONTRIBUTING that a test can hold: lengths of modules and functions, public names in tests, lazy imports."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import house_numbers

ROOT = Path(__file__).parents[1]
LONGEST_MODULE, LONGEST_BODY = 400, 45
# The functions that import a module of the package by its name in a string.
BY_NAME = {
    "draw/result_plots.py: plot_of",
    "images/images.py: function",
    "results/shown.py: plots",
    "results/storage.py: _kind",
    "scripts.py: module",
}
# What is counted may become less, and not more: then the number here follows it.
COUNTED = {
    "imports that run up a floor": 0,
    "isinstance on surfaces outside beams": 0,
    "isinstance on domains outside lens_map": 0,
    "extended and moving sources that import tracks": 0,
    "calls of the engine outside beams and lens_map": 7,
    "records with several fields in a sentence": 0,
    "assignments of three constants or more": 0,
    # `BandEdge.at`, as other scripts call it.
    "functions named by a particle": 1,
    "class names in two rooms": 0,
}
# Names with an underscore that others define: named tuples, notebooks, anywidget, functools.
FOREIGN = re.compile(r"_(replace|asdict|fields|make|repr_html_|handle_custom_msg|lru_cache_wrapper)")


def parsed(*folders: str, word: str = "") -> Iterator[tuple[Path, str, list[ast.AST]]]:
    """The modules of some folders of the checkout, of those that hold a word: paths, texts and nodes."""
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.py")):
            text, nodes = of_file(path)
            if word in text:
                yield path.relative_to(ROOT), text, nodes


@cache
def of_file(path: Path) -> tuple[str, list[ast.AST]]:
    """The text of a module, and all nodes of its tree."""
    text = path.read_text(encoding="utf-8")
    return text, list(ast.walk(ast.parse(text)))


def body_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its signature and its docstring."""
    body = function.body[1:] if ast.get_docstring(function, clean=False) and len(function.body) > 1 else function.body
    return (function.end_lineno or 0) - body[0].lineno + 1


def test_modules_and_functions_are_short():
    too_long = []
    for path, text, nodes in parsed("kerrcaustics", "studies", "figures"):
        count = text.count("\n")
        too_long += [f"{path}: {count} lines"] if count > LONGEST_MODULE else []
        functions = [node for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
        too_long += [f"{path}: {f.name}: {body_lines(f)} lines" for f in functions if body_lines(f) > LONGEST_BODY]
    assert too_long == []


def test_the_house_gets_no_worse():
    numbers = house_numbers.numbers()
    worse = {name: numbers[name] for name, most in COUNTED.items() if len(numbers[name]) > most}
    assert worse == {} and set(COUNTED) == {name for name, value in numbers.items() if isinstance(value, list)}


def name_of(function: ast.expr) -> str:
    """The last name of a function that is called."""
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def private_names(nodes: list[ast.AST]) -> Iterator[str]:
    """The private names of other modules that a module makes use of."""
    for node in nodes:
        names: list[str] = []
        if isinstance(node, ast.Attribute):
            own = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")
            names = [] if own else [node.attr]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("kerrcaustics"):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.Call) and name_of(node.func) in ("getattr", "setattr", "delattr"):
            texts = [word.value for word in node.args if isinstance(word, ast.Constant) and isinstance(word.value, str)]
            names = [text.split(".")[-1] for text in texts]
        yield from (name for name in names if re.match("_[a-zA-Z]", name) and not FOREIGN.fullmatch(name))


def test_tests_use_public_names():
    assert [f"{path}: {name}" for path, _, nodes in parsed("tests") for name in private_names(nodes)] == []


def test_modules_are_imported_by_name_in_few_places():
    found = set()
    for path, _, nodes in parsed("kerrcaustics", word="import_module"):
        for function in nodes:
            if isinstance(function, ast.FunctionDef):
                calls = [node for node in ast.walk(function) if isinstance(node, ast.Call)]
                named = [ast.unparse(node.args[0]) for node in calls if name_of(node.func) == "import_module"]
                if any("kerrcaustics" in name or "package" in name for name in named):
                    found.add(f"{path.relative_to('kerrcaustics')}: {function.name}")
    assert found == BY_NAME
