"""The explorer in a notebook."""

import json

import pytest

pytest.importorskip("anywidget", reason="anywidget is missing: pip install '.[notebook]'")

CELLS = [
    "import kerrcaustics as kc",
    "widget = kc.explore(spin=0.9, radius=6.03, orders=2)\nwidget",
    # As the page asks.
    "import json\n"
    "state = {**widget.state, 'theta': 90.0, 'phi': 270.0}\n"
    "widget._handle_custom_msg({'kind': 'question', 'text': json.dumps("
    "{'id': 1, 'want': 'full', 'state': state})}, [])",
    "print(json.dumps([widget.state['phi'], widget.numbers['images']['per_index'], "
    "widget.numbers['images']['certified']]))",
    "try:\n    widget.state = {**widget.state, 'spin': 2.0}\nexcept ValueError as error:\n    print(error)",
]


@pytest.mark.slow
def test_notebook_shows_the_widget_and_reads_its_state():
    nbformat = pytest.importorskip("nbformat", reason="nbclient is missing: pip install nbclient ipykernel")
    nbclient = pytest.importorskip("nbclient", reason="nbclient is missing: pip install nbclient ipykernel")
    pytest.importorskip("ipykernel", reason="ipykernel is missing: pip install nbclient ipykernel")
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS])
    nbclient.NotebookClient(book, timeout=120, kernel_name="python3").execute()
    shown = book.cells[1].outputs[0]["data"]
    assert "application/vnd.jupyter.widget-view+json" in shown
    assert json.loads(book.cells[3].outputs[0]["text"]) == [270.0, [1, 2], True]
    assert "`spin` must lie in" in book.cells[4].outputs[0]["text"]
    model = book.metadata["widgets"]["application/vnd.jupyter.widget-state+json"]["state"]
    assert any("function mount(" in entry["state"].get("_esm", "") for entry in model.values())
