"""The page that `kerrcaustics` alone prints: all commands, and three to try."""

import cyclopts
from rich.console import Console
from rich.table import Table

from kerrcaustics.cli.terminal import console, say

_TRY = {
    "demo": "draws the caustics of a rapidly spinning hole, seen from two places",
    "images --spin 0.999 --radius 2.6 --star 90 141": "finds all images of a star",
    "explore": "opens a page for dragging a star over the caustics",
}


def first_page(app: cyclopts.App, version: str) -> None:
    """Print all commands, and three to try."""
    out = console()
    say(out, f"kerrcaustics {version}. {app.help}")
    say(out, "\nTo begin:")
    _columns(out, {f"kerrcaustics {command}": what for command, what in _TRY.items()})
    say(out, "\nCommands, each with --help:")
    _columns(out, {name: app[name].help.strip().split("\n")[0] for name in sorted(app) if not name.startswith("-")})
    say(out, "\nkerrcaustics --install-completion lets the shell complete them.")


def _columns(out: Console, lines: dict[str, str]) -> None:
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True)
    for name, what in lines.items():
        table.add_row(f"  {name}", what)
    out.print(table)
