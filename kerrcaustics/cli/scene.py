"""The command `scene`."""

from kerrcaustics.choices import suggestion
from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput
from kerrcaustics.cli.options import COMMON, CommonOptions, Flag
from kerrcaustics.cli.terminal import say


@app.command(**with_examples("scene", "scene --template disk > scene.toml"))
def scene(*, template: str | None = None, keys: Flag = False, common: CommonOptions = COMMON) -> None:
    """Print a commented scene file as a starting point; without a name, list all templates.

    Parameters
    ----------
    template
        Name of the template.
    keys
        Print all tables and keys of scene files, with their meanings, in Markdown.
    """
    import sys
    import tomllib

    if keys:
        if template is not None or common.json is not None:
            raise BadInput("Argument --keys must be used alone.")
        from kerrcaustics.scene_files.key_tables import key_tables

        sys.stdout.write(f"{key_tables()}\n")
        return
    from kerrcaustics.scene_files.templates import first_lines, template_text

    templates = first_lines()
    common.check()
    if template is None:
        common.write({"schema": "kerrcaustics/templates/1", "templates": templates})
        out = common.console()
        say(out, "kerrcaustics scene --template NAME > scene.toml saves one of these templates:")
        for name, line in templates.items():
            say(out, f"  {name:<14}{line}")
        return
    if template not in templates:
        raise BadInput(
            f"Argument --template must be one of {', '.join(templates)}, but is {template}"
            f"{suggestion(template, templates)}"
        )
    text = template_text(template)
    common.write({"schema": "kerrcaustics/scene/1", "template": template, **tomllib.loads(text)})
    if common.json != "-":
        sys.stdout.write(text)
