"""The figures of the paper and the films, in docs/figures_of_the_paper.md and docs/films.md, from what scripts say.

python docs/figure_list.py
"""

import ast
import re
from pathlib import Path

from kerrcaustics.scene_files.templates import film_templates, template_text

FIGURES = Path(__file__).parents[1] / "figures"


def caption(script: Path) -> tuple[str, str]:
    """Return the title of a script, and the rest of its docstring on one line."""
    title, _, text = (ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or "").split("\n", 2)
    return title, " ".join(text.split())


def paper_figures() -> str:
    """Return the figures of JTFT as a table in Markdown: the script, what is the paper's in it, and what is ours."""
    rows = []
    for script in FIGURES.glob("*.py"):
        title, text = caption(script)
        number = re.search(r"(?:Remakes|that of) JTFT figures? (A?)(\d+)", text)
        parts = re.search(r"The paper's: (.*?)\.(?: .*?)? Ours: (.*?)\.(?: |$)", text)
        if number and parts:
            key = (number[1], int(number[2]), script.stem)
            link = f"[{title}](gallery/{script.stem}.rst)"
            ours = re.sub(r" \(docs/[^)]*\)", "", parts[2])
            rows.append((key, f"| {number[1]}{number[2]} | {link} | {parts[1]} | {ours} |"))
    return "\n".join(["| JTFT | here | the paper's | ours |", "|---|---|---|---|", *(row for _, row in sorted(rows))])


def film_list() -> str:
    """Return the films as a table in Markdown, each with its first sentences: those of scripts, then of scene files."""
    films = {script.stem: caption(script)[1] for script in sorted((FIGURES / "films").glob("*.py"))}
    for name in film_templates():
        lines = re.match(r"(?:#.*\n)+", template_text(name))
        text = " ".join(line.strip("# ") for line in lines[0].splitlines()).removeprefix("A film: ") if lines else ""
        films[name] = text[:1].upper() + text[1:].partition(" kerrcaustics ")[0]
    rows = [f"| `{name}` | {' '.join(re.split(r'(?<=[.]) (?=[A-Z])', text)[:2])} |" for name, text in films.items()]
    return "\n".join(["| film | what it shows |", "|---|---|", *rows])


if __name__ == "__main__":
    print(paper_figures(), film_list(), sep="\n\n")
