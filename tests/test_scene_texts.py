"""Texts in scene files: captions, and definitions that are many or long."""

import pytest

from kerrcaustics.scene_files.expressions import Formula, Moment, formula
from kerrcaustics.scene_files.scene_file import SceneFile

SCENE = """
[hole]
spin = 0.5
[camera]
radius = 10
[view]
width = 64
height = 36
field_of_view_deg = 40
"""


@pytest.fixture
def scene(tmp_path):
    """The scene of a file with more text."""

    def read(more):
        path = tmp_path / "scene.toml"
        path.write_text(SCENE + more, encoding="utf-8")
        return SceneFile.read(path)

    return read


@pytest.mark.parametrize("letter", ["\\u0007", "\\u001b", "\\t", "\\r", "\\u202e", "\\u0000"])
def test_captions_with_control_characters_are_refused(scene, letter):
    with pytest.raises(
        ValueError, match=r"overlays.caption must be printable, in one line or several, but is "
    ) as error:
        scene(f'[overlays]\ncaption = "t = {{t}}{letter}"\n')
    assert str(error.value).isprintable()


def test_captions_may_have_lines_and_letters_of_any_script(scene):
    scene('[overlays]\ncaption = "φ′ = {azimuth_deg}°\\nсолнце"\n')


def test_definitions_are_limited_in_all(scene):
    """999 of 300 names each would take many seconds."""
    line = "+".join(f"x{i % 10}" for i in range(300))
    texts = "\n".join(f'x{i} = "{line if i > 9 else 1}"' for i in range(999))
    with pytest.raises(ValueError, match="definitions must be at most 100000 characters long in all, but is "):
        scene(f"[definitions]\n{texts}\n")


class _Counted(frozenset):
    """Names that count how often one of them is looked at."""

    looks = 0

    def __iter__(self):
        for name in super().__iter__():
            _Counted.looks += 1
            yield name


def test_names_that_need_many_names_are_looked_at_a_few_times_each(monkeypatch):
    """Each of 60 needs all before it: as many looks as there are names in the definitions, a few times."""
    texts = {f"x{i}": " + ".join(["1", *(f"x{j}" for j in range(i))]) for i in range(60)}
    plain = {name: formula(name, text) for name, text in texts.items()}
    formulas = {name: Formula(name, one.text, _Counted(one.names), one.value) for name, one in plain.items()}
    assert Moment(0.0, formulas).named("x59").value == 2.0**59
    assert _Counted.looks <= 3 * sum(len(one.names) for one in plain.values())
