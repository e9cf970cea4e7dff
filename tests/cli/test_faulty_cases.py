"""345 faulty logs, settings and friction files with one push: found, not judged, refused or stated, never silent.

Of each kind `make test` judges the weakest and the strongest, and both sides of where its outcome turns; `make bench`
judges all. What becomes of each stands in ``faulty_cases.txt``; a case that changes its outcome is to be looked at, and
the table brought up to it when the new one is as honest: the test names the outcome it found.
"""

from __future__ import annotations

import re
from collections import Counter
from itertools import groupby, pairwise
from pathlib import Path

import clock_and_setting_faults as settings
import pytest
import signal_faults as signals
from faulty_case import Signals, clean_signals, judge, spoil, statements

from collaudit.core.data.audit_result import FrictionFile
from collaudit.reports.files.run_files import read_friction

FAMILIES = (
    signals.stuck, signals.missing, signals.scales, signals.offsets, signals.shapes, signals.swaps,
    settings.clocks, settings.recorders, settings.settings, settings.friction_files,
)  # fmt: skip
CASES = {name: fault for family in FAMILIES for name, fault in family()}
TABLE = dict(line.split(": ") for line in Path(__file__).with_name("faulty_cases.txt").read_text().splitlines())
OUTCOMES = {"found", "not judged", "refused", "stated"}


def bounds() -> set[str]:
    """Of each kind the ends, and both sides of each change of outcome, in the order of its strengths."""
    kinds = [list(names) for _, names in groupby(CASES, lambda name: re.sub(r"\d[\d.e+]*", "#", name))]
    turns = [pair for names in kinds for pair in pairwise(names) if TABLE[pair[0]] != TABLE[pair[1]]]
    return {name for names in [*kinds, *turns] for name in (names[0], names[-1])}


BOUNDS = bounds()


@pytest.fixture(scope="module")
def judged_with(arm) -> tuple[str, FrictionFile, Signals, frozenset[str]]:
    """Settings, friction, whole signals, and what is said of a log without push and fault."""
    text, friction = arm.config.read_text(), read_friction(arm.friction)
    return text, friction, clean_signals(text), statements(text, friction, clean_signals(text, 0.0))


def test_the_table_is_whole() -> None:
    assert TABLE.keys() == CASES.keys()
    assert len(TABLE) >= 300
    assert set(TABLE.values()) <= OUTCOMES
    print(Counter(TABLE.values()))


def test_without_fault_the_push_is_found_and_without_push_nothing(judged_with) -> None:
    text, friction, whole, known = judged_with
    assert judge(text, friction, spoil(whole, lambda s: None), known).outcome == "found"
    assert judge(text, friction, clean_signals(text, 0.0), known).outcome == "silent"


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "name", [name if name in BOUNDS else pytest.param(name, marks=pytest.mark.bench) for name in CASES]
)
def test_no_fault_hides_a_push_in_silence(name: str, judged_with) -> None:
    text, friction, whole, known = judged_with
    outcome = judge(text, friction, spoil(whole, CASES[name]), known)
    assert outcome.outcome != "silent", "a pass that says nothing of the fault"
    assert outcome.outcome == TABLE[name], outcome.why
