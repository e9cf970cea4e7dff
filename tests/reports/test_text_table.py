"""Tables of a terminal: aligned by what a terminal shows, cut to its width, whole in files."""

from __future__ import annotations

import pytest
import samples
from hypothesis import given, settings
from hypothesis import strategies as st
from wcwidth import wcswidth

from collaudit.reports.terminal.screen_text import audit_text
from collaudit.reports.terminal.text_table import table

LINES = [
    ("shoulder_pan", "1.25", "a reason that is much longer than the others"),
    ("关节", "1000.5", "短い理由ですが、それでも幅は広いのです、とても広いのです"),
]


def test_columns_are_those_of_a_terminal() -> None:
    lines = table(("name", "n"), [("关节", "1"), ("e\u0301lbow", "22")], numeric=(1,)).splitlines()
    assert lines == ["name    n", "-----  --", "关节    1", "e\u0301lbow  22"]


def test_a_file_gets_the_table_whole() -> None:
    text = table(("joint", "n", "reason"), LINES, (1,))
    assert all(cell in text for line in LINES for cell in line)


def test_a_terminal_gets_columns_of_text_folded_first_and_numbers_whole() -> None:
    lines = table(("joint", "n", "reason"), LINES, (1,), width=45).splitlines()
    assert all(wcswidth(line) <= 45 for line in lines)
    assert any("1000.5" in line for line in lines)
    assert lines[2] == "shoulder_pan    1.25  a reason that is much" and lines[3].split() == [
        "longer",
        "than",
        "the",
        "others",
    ]


def test_a_fold_inside_a_wide_letter_keeps_the_width() -> None:
    for width in range(12, 60):
        assert all(wcswidth(line) <= width for line in table(("j", "n", "r"), LINES, (1,), width).splitlines())


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.text(max_size=30), st.text(max_size=8), st.text(max_size=60)), max_size=4),
    st.integers(1, 120),
)
def test_no_line_is_wider_than_the_terminal(lines: list[tuple[str, str, str]], width: int) -> None:
    text = table(("joint", "n", "reason"), lines, (1,), width)
    assert text.endswith("\n") and len(text.splitlines()) >= len(lines) + 2
    assert all(wcswidth(line) <= width for line in text.splitlines())


def test_a_folded_table_loses_nothing() -> None:
    said = "A 7.114 [7.09, 7.132]  B 2.508 [2.427, 2.593]  C 25.9 [24.6, 27.2]  D 16.93 [16.9, 16.97]"
    text = table(("joint", "parameters", "points"), [("shoulder_lift_joint", said, "31")], (2,), 60)
    lines = text.splitlines()
    assert all(wcswidth(line) <= 60 for line in lines)
    assert "shoulder_lift_joint" in lines[2], "the name gives way last"
    parts = [line[21:].removesuffix("31").strip() for line in lines[2:]]
    assert "  ".join(parts) == said, "each value stays beside its interval"
    assert lines[2].split()[-1] == "31"


@pytest.mark.parametrize("width", range(45, 80))
def test_names_that_differ_at_their_ends_stay_told_apart(width: int) -> None:
    names = ("A/cell1/moving_arm_mounted_on_a_wall_50sec.csv", "A/cell1/moving_arm_mounted_on_a_wall_50secLoad.csv")
    lines = [("FAIL", name, "2", "a reason of many words, more than there is room for") for name in names]
    shown = table(("verdict", "log", "contacts", "reasons"), lines, (2,), width, text_below=True).splitlines()
    assert all(wcswidth(line) <= width for line in shown)
    first, second = (line for line in shown if line.startswith("FAIL"))
    assert "50sec.csv" in first and "50secLoad.csv" in second and "A/cell1/" in first


def test_long_titles_are_folded_before_anything_is_cut() -> None:
    head = ("joint", "whenever judged", "alarms in 50 %")
    *titles, rule, row = table(head, [("shoulder_lift_joint", "25.8", "20.5")], (1, 2), 40).splitlines()
    assert len(titles) == 2
    assert sorted(" ".join(titles).split()) == sorted(" ".join(head).split())
    assert rule.split()[0] == "-" * 19
    assert row.split() == ["shoulder_lift_joint", "25.8", "20.5"]


def test_text_without_room_beside_a_row_stands_below_it() -> None:
    lines = [("PASS", "a.mcap", "a reason of many words"), ("FAIL", "b.mcap", "")]
    head = ("verdict", "log of the night", "reasons")
    assert table(head, lines, width=80, text_below=True) == table(head, lines)
    narrow = table(head, lines, width=25, text_below=True).splitlines()
    assert narrow[-3:] == ["PASS     a.mcap", "    a reason of many words", "FAIL     b.mcap"]


def test_sentences_of_an_audit_are_never_cut() -> None:
    result = samples.failed(5000).result
    text = audit_text(result, width=40)
    assert "no safety function" in text
    assert all(reason in " ".join(text.split()) for reason in result.reasons)
    assert audit_text(result) != text


def test_a_number_behind_long_text_is_still_seen() -> None:
    turned = [(joint, reason, n) for joint, n, reason in LINES]
    lines = table(("joint", "reason", "n"), turned, (2,), width=45).splitlines()
    assert all(wcswidth(line) <= 45 for line in lines)
    assert [line.split()[-1] for line in lines if line.endswith((" 1.25", " 1000.5"))] == ["1.25", "1000.5"]
