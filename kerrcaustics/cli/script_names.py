"""What commands that run figures, films and studies share."""

from typing import TYPE_CHECKING

from kerrcaustics.cli.app import BadInput

if TYPE_CHECKING:
    from kerrcaustics.scripts import ScriptFolder


def script_names(scripts: "ScriptFolder", what: str) -> list[str]:
    """Names of the scripts in a folder; refused where there is none."""
    names = scripts.names()
    if not names:
        raise BadInput(f"{what} need an installed wheel or a checkout: there is no folder {scripts.folder}.")
    return names
