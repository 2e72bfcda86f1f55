"""Progress of calls: what a listener hears, when a bar is shown, and that nothing is reported twice."""

import re
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

import kerrcaustics as kc
from kerrcaustics.cli import terminal
from kerrcaustics.results import progress
from kerrcaustics.results.progress import in_steps, listening, report, with_progress
from kerrcaustics.results.time_left import TimeLeft

CAMERA = kc.Camera(0.9, 10.0, 1.2)
VIEW = kc.pictures.View.toward_hole(CAMERA, width=16, height=9, field_of_view=1.0)
GLOW = kc.disks.Volume(0.1, 6504.0, inner=5.0, outer=8.0)
# The calls that take long, and a word of what they say is done.
CALLS = {
    "caustics": (lambda heard: kc.caustics(CAMERA, 1, progress=heard), "cusps and extremes"),
    "caustics in the plane": (
        lambda heard: kc.caustics(CAMERA, 1, end=kc.EquatorialPlane(1), progress=heard),
        "order 1 of 1",
    ),
    "caustic_tubes": (lambda heard: kc.caustic_tubes(CAMERA, 1, [float("inf"), 20.0], progress=heard), "tube 1 of 1"),
    "star_images": (lambda heard: kc.star_images(CAMERA, (1.1, 2.0), 0, progress=heard), "rays all over the sky"),
    "count_map": (lambda heard: kc.count_map(CAMERA, 0, 4, end=kc.EquatorialPlane(1), progress=heard), "circle 4 of 4"),
    "star_tracks": (lambda heard: kc.star_tracks(CAMERA.at_rest(), 1.3, 0, progress=heard), "images followed"),
    "follow_star": (lambda heard: kc.follow_star([CAMERA, CAMERA], (1.1, 2.0), 0, progress=heard), "camera 2 of 2"),
    "isoradials": (
        lambda heard: kc.isoradials(CAMERA, [9.0, 12.0], 1, 32, progress=heard),
        "crossing 1 of 1: circle 2",
    ),
    "light_curve": (lambda heard: kc.light_curve(CAMERA, 8.0, 8, crossings=2, progress=heard), "crossing 2 of 2"),
    "render": (lambda heard: kc.render(CAMERA, VIEW, kc.skies.Checkerboard(), progress=heard), "sky map"),
    "render_volume": (
        lambda heard: kc.pictures.render_volume(CAMERA, VIEW, GLOW, progress=heard),
        "light along the rays",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
def test_long_calls_say_what_they_do(name):
    call, word = CALLS[name]
    reported = []
    call(lambda *what: reported.append(what))
    parts = [part for _, part in reported]
    assert any(word in what for what, _ in reported), reported
    # Rays that are kept from another call are half of the way.
    assert parts == sorted(parts) and parts[0] <= 0.5 and reported[-1] == ("done", 1.0)


@with_progress
def inner(progress=None):
    for _ in in_steps("line", range(2)):
        report("halved", 0.5)
    return "result"


@with_progress
def outer(count, progress=None):
    return [inner() for _ in in_steps("curve", range(count))]


def test_steps_within_steps_are_parts_of_the_whole():
    reported = []
    assert outer(2, progress=lambda *what: reported.append(what)) == ["result", "result"]
    assert reported[:4] == [
        ("curve 1 of 2", 0.0),
        ("curve 1 of 2: line 1 of 2", 0.0),
        ("curve 1 of 2: line 1 of 2: halved", 0.125),
        ("curve 1 of 2: line 2 of 2", 0.25),
    ]
    assert [part for _, part in reported] == [0.0, 0.0, 0.125, 0.25, 0.375, 0.5, 0.5, 0.625, 0.75, 0.875, 1.0]


def test_without_a_listener_nothing_is_reported(capsys):
    assert outer(3) == 3 * ["result"] and outer(3, None) == 3 * ["result"]
    with listening(lambda *_: pytest.fail("told")):
        assert inner(progress=False) == "result"
    assert capsys.readouterr() == ("", "")


def test_a_listener_that_raises_ends_the_call_and_listens_no_longer():
    def stop(_what, part):
        if part > 0.2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        outer(2, progress=stop)
    assert outer(1) == ["result"]


@pytest.mark.parametrize("wrong", ["bar", 1, [print]])
def test_what_cannot_listen_is_refused(wrong):
    with pytest.raises(ValueError, match="Argument `progress` must be True, False or a function"):
        kc.caustics(CAMERA, progress=wrong)


def bars(monkeypatch):
    """The bars that are asked for from now on, by their patience."""
    asked = []

    @contextmanager
    def noted(after=0.0):
        asked.append(after)
        yield lambda _what, _part: None

    monkeypatch.setattr(progress, "bar", noted)
    return asked


def test_true_is_a_bar_at_once_and_notebooks_have_one_after_a_second(monkeypatch):
    asked = bars(monkeypatch)
    outer(1)
    assert asked == []
    outer(1, progress=True)
    monkeypatch.setattr(progress, "in_notebook", lambda: True)
    outer(1)
    outer(1, progress=False)
    assert asked == [0.0, 1.0]


CELLS = ("work(1)", "work(5)", "work(1, progress=True)", "work(5, progress=False)")
WORK = """
import time
from kerrcaustics.results.progress import in_steps, with_progress

@with_progress
def work(count, progress=None):
    for _ in in_steps("<line>", range(count)):
        time.sleep(0.3)
"""


@pytest.mark.slow
def test_a_bar_in_a_notebook_comes_after_a_second_and_leaves_nothing():
    nbformat = pytest.importorskip("nbformat", reason="nbclient is missing: pip install nbclient ipykernel")
    nbclient = pytest.importorskip("nbclient", reason="nbclient is missing: pip install nbclient ipykernel")
    cells = [nbformat.v4.new_code_cell(text) for text in (WORK, *CELLS)]
    shown = {number: [] for number in range(len(cells))}

    class Client(nbclient.NotebookClient):
        def process_message(self, msg, cell, cell_index):
            shown[cell_index] += [msg["content"]["data"]["text/html"]] if "display" in msg["msg_type"] else []
            return super().process_message(msg, cell, cell_index)

    resources = {"metadata": {"path": Path(__file__).parents[1]}}
    Client(nbformat.v4.new_notebook(cells=cells), timeout=120, kernel_name="python3", resources=resources).execute()
    assert shown[1] == shown[4] == []
    assert re.fullmatch(r'<progress value="0.800"></progress> &lt;line&gt; 5 of 5 \(1 s\)', shown[2][0])
    assert shown[3][0] == '<progress value="0.000"></progress> &lt;line&gt; 1 of 1 (0 s)'
    assert shown[2][-1] == shown[3][-1] == ""


def test_a_notice_goes_to_the_listener_or_below_the_cell_or_to_the_terminal(monkeypatch, capsys):
    told = []
    with progress.listening(lambda what, part: told.append((what, part))):
        progress.notice("compiling")
    assert told == [("compiling", 0.0)]
    progress.notice("compiling")
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    progress.notice("compiling")
    assert capsys.readouterr() == ("", "compiling\n")
    display = pytest.importorskip("IPython.display", reason="IPython is missing: pip install ipykernel")
    monkeypatch.setattr(display, "display", lambda content, raw: told.append(content["text/html"]))
    monkeypatch.setattr(progress, "in_notebook", lambda: True)
    progress.notice("<compiling>")
    assert told[1:] == ["<small>&lt;compiling&gt;</small>"] and capsys.readouterr() == ("", "")


def test_a_bar_waits(monkeypatch):
    from rich.progress import Progress

    started = []
    monkeypatch.setattr(Progress, "start", lambda self: started.append(time.perf_counter()))
    with progress.bar(0.2) as tell:
        tell("sky map", 0.1)
        assert not started
        time.sleep(0.25)
        tell("sky map", 0.2)
    assert started


def test_a_bar_is_not_full_while_there_is_still_work(monkeypatch):
    from rich.progress import Progress

    totals = []
    monkeypatch.setattr(Progress, "stop", lambda self: totals.append(self.tasks[0].total))
    for bar_of in (progress.bar, lambda: terminal_progress(monkeypatch)):
        for reports, total in (([("sky map", 0.5)], 1.0), ([("sky map", 0.5), ("drawing", 1.0)], None)):
            with bar_of() as tell:
                for what, part in reports:
                    tell(what, part)
            assert totals.pop() == total


def terminal_progress(monkeypatch):
    """The bar of the command line, in a terminal."""
    monkeypatch.setattr("rich.console.Console.is_terminal", True)
    return terminal.progress()


def test_no_time_is_said_to_be_left_while_the_last_step_is_overdue():
    estimate = TimeLeft()
    for now in range(6):
        estimate.note(10.0 * now, now / 8)
    assert estimate.seconds_left(50.0) == pytest.approx(30.0)
    assert estimate.seconds_left(57.0) == pytest.approx(23.0)
    # A step that takes twice as long as the others: the time of the two after it is left.
    assert estimate.seconds_left(70.0) == pytest.approx(20.0)
    estimate.note(80.0, 7 / 8)
    assert estimate.seconds_left(1000.0) is None


def test_progress_is_in_plain_words():
    """No word of the inside of the package, in any report."""
    inner = "halved sheet chart link node skeleton branch march"
    for path in sorted(Path(kc.__file__).parent.rglob("*.py")):
        for text in re.findall(r"\b(?:report|in_steps|stage)\(\s*f?\"([^\"]+)\"", path.read_text(encoding="utf-8")):
            assert not [word for word in inner.split() if word in text], f"{path}: {text}"
