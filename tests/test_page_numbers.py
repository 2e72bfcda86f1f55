"""Numbers of pages that come from studies are those of the record, the tables in docs/tables, to the digits shown."""

import re
import shutil

import pytest
from offenders import for_each

from kerrcaustics.scripts import HOME, STUDIES

PAGES = STUDIES.module("pages")


def text_of(page):
    return (HOME / page).read_text(encoding="utf-8")


@for_each(page=PAGES.pages())
def test_a_page_has_the_numbers_of_the_record(page):
    """Otherwise: `python -m studies.pages FOLDER`, as studies/README.md says."""
    assert PAGES.rewritten(page, text_of(page), PAGES.record()) == text_of(page)


@for_each(number=PAGES.NUMBERS)
def test_another_number_is_noticed(number):
    text = text_of(number.page)
    at = number.on_page(text)
    wrong = text[: at.start(1)] + "7.77" + text[at.end(1) :]
    assert PAGES.rewritten(number.page, wrong, PAGES.record()) == text


def test_a_sentence_that_is_gone_is_noticed():
    number = PAGES.NUMBERS[0]
    with pytest.raises(ValueError, match=f"{number.page} must have .* 0 times"):
        PAGES.rewritten(number.page, "Nothing.", PAGES.record())


def test_a_cell_is_found_by_the_words_of_its_row_and_of_the_rows_above():
    table = PAGES.ReportTable(["result", "setting", "time"], [["a", "x", "1"], ["", "y", "2"], ["b", "y", "3"]], [])
    found = [PAGES.Cell("one", row, "time").text({"one": [table]}) for row in (("a", "y"), ("b", "y"), ("b",))]
    assert found == ["2", "3", "3"]
    with pytest.raises(ValueError, match="must have a row"):
        PAGES.Cell("one", ("c", "y"), "time").text({"one": [table]})


def test_studies_of_a_folder_are_taken_into_tables_pictures_and_pages(tmp_path):
    home, folder = tmp_path / "home", tmp_path / "new"
    for page in PAGES.pages():
        (home / page).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(HOME / page, home / page)
    for name in PAGES.STUDIES:
        (folder / f"study-{name}").mkdir(parents=True)
        for place, ending in (("tables", "md"), ("images", "png")):
            (home / "docs" / place).mkdir(exist_ok=True)
            shutil.copyfile(HOME / "docs" / place / f"{name}.{ending}", folder / f"study-{name}" / f"{name}.{ending}")
        (folder / f"study-{name}" / f"{name}.json").write_text("{}")
    taken = PAGES.take(folder, home)
    assert {path.name for path in taken} == {f"{name}.{end}" for name in PAGES.STUDIES for end in ("md", "png")}
    assert PAGES.take(folder, home) == []
    cost = folder / "study-cost" / "cost.md"
    cost.write_text(re.sub(r"\| \+ redshift \| [\d.]+", "| + redshift | 9.87", cost.read_text()))
    assert [path.name for path in PAGES.take(folder, home)] == ["cost.md", "README.md"]
    assert "A beam takes 9.87 µs" in (home / "README.md").read_text()
    (folder / "study-cost" / "cost.json").unlink()
    with pytest.raises(ValueError, match="must hold one record of cost"):
        PAGES.take(folder, home)
