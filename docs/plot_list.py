"""The list of plots in docs/plots.md: what the method `plot` of each class draws, and its settings.

python docs/plot_list.py
"""

import inspect

from kerrcaustics.draw.result_plots import PLOTS, plot_of


def plot_list() -> str:
    """Return the classes that have a plot, those with the same one together, as a table in Markdown."""
    rows = ["| class | what `plot` draws | settings |", "|---|---|---|"]
    for place in dict.fromkeys(PLOTS.values()):
        classes = [name for name, other in PLOTS.items() if other == place]
        names, draw = ", ".join(f"`{name}`" for name in classes), plot_of(classes[0])
        text = " ".join(inspect.cleandoc(draw.__doc__ or "").split()).rstrip(".")
        parameters = inspect.signature(draw).parameters.values()
        settings = ", ".join(f"`{one.name}=`" for one in list(parameters)[2:])
        rows.append(f"| {names} | {text} | {settings} |")
    return "\n".join(rows)


if __name__ == "__main__":
    print(plot_list())
