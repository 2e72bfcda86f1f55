"""The list of results in docs/results.md: what each class says of itself, and the schema of its record.

python docs/result_list.py
"""

import inspect
from importlib import import_module

from kerrcaustics.results.declared import LAYOUTS
from kerrcaustics.results.storage import HOMES


def result_list() -> str:
    """Return all results as a table in Markdown."""
    rows = ["| result | what it is | schema of the record |", "|---|---|---|"]
    for home, names in HOMES.items():
        for name in names.split():
            kind = getattr(import_module(f"kerrcaustics.{home}"), name)
            text = inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0]
            rows.append(f"| `{name}` | {' '.join(text.split()).rstrip('.')} | `{LAYOUTS[kind].schema}` |")
    return "\n".join(rows)


if __name__ == "__main__":
    print(result_list())
