"""What commands that run scripts of a checkout share."""

from typing import TYPE_CHECKING

from kerrcaustics.cli.app import BadInput

if TYPE_CHECKING:
    from kerrcaustics.scripts import ScriptFolder


def script_names(scripts: "ScriptFolder", what: str) -> list[str]:
    """Names of the scripts in a folder of the checkout; refused where there is none."""
    names = scripts.names()
    if not names:
        raise BadInput(f"{what} need a checkout of kerrcaustics, and there is none: no folder {scripts.folder}.")
    return names
