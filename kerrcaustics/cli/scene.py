"""The command `scene`."""

from kerrcaustics.cli.app import BadInput, app, with_examples
from kerrcaustics.cli.terminal import console, say


@app.command(**with_examples("scene", "scene --template disk > scene.toml"))
def scene(*, template: str | None = None) -> None:
    """Print a scene file with comments, to begin with; without a name, list those there are.

    Parameters
    ----------
    template
        Which one.
    """
    import sys

    from kerrcaustics.scene_files.templates import first_lines, template_text

    known = first_lines()
    if template is None:
        out = console()
        say(out, "kerrcaustics scene --template NAME > scene.toml prints one of these:")
        for name, line in known.items():
            say(out, f"  {name:<14}{line}")
        return
    if template not in known:
        raise BadInput(f"Argument --template must be one of {', '.join(known)}, but is {template}.")
    sys.stdout.write(template_text(template))
