"""A section: the one form of a report's facts, and the three that render it leave none of them out."""

from __future__ import annotations

from collaudit.reports.formats.night_texts import section_lines
from collaudit.reports.page.environment import environment
from collaudit.reports.sections.section import Section
from collaudit.reports.terminal.text_table import section_text, sections_text

LEVELS = Section(
    "Levels",
    ("joint", "level", "γ", "remark"),
    (("a", "4.00 N·m", "–", "first"), ("b", "1.50 N·m ▲", "2.00 N·m", "second")),
    ("A note.",),
)


def on_page(found: Section) -> str:
    template = environment().from_string("{% import 'marks.html.j2' as marks %}{{ marks.section(found) }}")
    return template.render(found=found)


def test_every_renderer_shows_every_cell_and_note() -> None:
    page, terminal, markdown = on_page(LEVELS), section_text(LEVELS), "\n".join(section_lines(LEVELS))
    for cell in (cell.partition(" ")[0] for row in LEVELS.rows for cell in row):
        assert all(cell in text for text in (page, terminal, markdown)), cell
    assert all("A note." in text for text in (page, terminal, markdown))


def test_a_unit_that_all_cells_of_a_column_share_stands_in_its_heading() -> None:
    shown = LEVELS.units_in_headings()
    assert shown.columns == ("joint", "level, N·m", "γ, N·m", "remark")
    assert shown.rows == (("a", "4.00", "–", "first"), ("b", "1.50 ▲", "2.00", "second"))
    mixed = Section("", ("joint", "level"), (("a", "4.00 N·m"), ("lift", "9.00 N")))
    assert mixed.units_in_headings() == mixed


def test_columns_of_numbers_are_known_by_their_cells() -> None:
    assert LEVELS.numeric == (1, 2)
    assert Section("", ("n",), (("–",),)).numeric == ()


def test_a_column_that_says_nothing_is_left_out() -> None:
    head = ("joint", "asked")
    assert Section("", head, (("a", ""), ("b", ""))).only(*head).columns == ("joint",)
    assert Section("", head, (("a", ""), ("b", "2 N"))).only(*head).columns == head


def test_an_empty_section_says_its_notes_or_nothing() -> None:
    assert section_text(Section("Sweeps", (), (), ("none",))) == "Sweeps\n  none\n"
    assert sections_text([Section("Sweeps", ("joint",), ())]) == ""


def test_hostile_cells_are_escaped() -> None:
    found = Section("<b>", ("joint",), (("<script>\n\x1b[0m",),))
    assert "<script>" not in on_page(found) and "\x1b" not in on_page(found)
    assert "\x1b" not in section_text(found)
    assert "<script>" not in "\n".join(section_lines(found))
