"""Scores worked out by hand, label files, and the controller's alarms."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from strong_pushes import above_s

from collaudit.core.data.audit_result import Collision
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.signals import State
from collaudit.core.errors import LogError
from collaudit.core.scoring.detection_score import JudgedResidual, TrueEvent, read_truth, score, true_events
from collaudit.core.scoring.known_events import Mark, compare_controller_alarms

T = 0.01


def judged(ratio: np.ndarray, state: np.ndarray | None = None) -> JudgedResidual:
    n = ratio.shape[0]
    codes = np.zeros(ratio.shape, dtype=np.int8) if state is None else state
    return JudgedResidual(T * np.arange(n), ratio, codes, ("a", "b"), 3)


def alarm(joint: str, onset_s: float, detected_s: float) -> Collision:
    return Collision(joint, onset_s, detected_s, 0.04, 8.0, 4.0, "free")


def test_recall_precision_and_delay_by_hand() -> None:
    ratio = np.full((3000, 2), 0.1)
    ratio[500:520, 0] = 2.0  # found at 5.02
    ratio[1500:1520, 1] = 0.9  # missed
    ratio[2500:2510, 1] = 1.5  # nobody there
    events = [TrueEvent(5.0, 5.2, {"a": 5.0}), TrueEvent(15.0, 15.2, {"b": 15.0}), TrueEvent(28.0, 28.1, {})]
    alarms = [alarm("a", 5.0, 5.02), alarm("b", 25.0, 25.02)]
    both, a, b = score(events, alarms, judged(ratio))
    assert (both.events, both.found, both.false_alarms) == (2, 1, 1)
    assert both.recall == 0.5
    assert both.precision == 0.5
    assert both.delay_s == pytest.approx((0.02,))
    assert both.false_alarms_per_hour == pytest.approx(1 / (30.0 / 3600.0))
    assert (a.recall, a.precision) == (1.0, 1.0)
    assert (b.recall, b.precision) == (0.0, 0.0)
    assert a.auc == 1.0
    # the missed event at 0.9 ranks above all clean windows but the false one
    assert b.auc == pytest.approx(1.0 - 1.0 / 27.0, abs=0.01)
    assert both.roc[0] == (0.0, 0.0)
    assert both.roc[-1] == (1.0, 1.0)


def test_what_could_not_be_seen_is_neither_found_nor_missed() -> None:
    ratio = np.full((1000, 2), 0.1)
    state = np.zeros(ratio.shape, dtype=np.int8)
    state[480:600, 0] = State.FRICTION_INTERVAL
    both = score([TrueEvent(5.0, 5.5, {"a": 5.0})], [], judged(ratio, state))[0]
    assert (both.events, both.found, both.not_observable) == (1, 0, 1)
    assert both.recall is None
    state[:] = State.JUDGED
    both = score([TrueEvent(5.0, 5.5, {"a": 5.0})], [], judged(ratio, state))[0]
    assert both.recall == 0.0


def test_time_above_a_level_of_a_raised_cosine_push() -> None:
    t = 1e-5 * np.arange(60_000)
    inside = np.minimum(t - 0.1, 0.4 - t)
    torque = 9.0 * (0.5 - 0.5 * np.cos(np.pi * np.clip(inside / 0.04, 0, 1)))
    facts = {"peak_nm": 9.0, "above_gamma_s": float(np.count_nonzero(torque > 4.0)) * 1e-5}
    for factor in (1.0, 1.3, 2.0):
        expected = float(np.count_nonzero(torque > factor * 4.0)) * 1e-5
        assert above_s(0.3, facts, 4.0, factor) == pytest.approx(expected, abs=1e-4)
    assert above_s(0.3, facts, 4.0, 2.3) == 0.0


def test_labels_from_a_table(tmp_path: Path) -> None:
    path = tmp_path / "labels.csv"
    path.write_text("onset_s,end_s,joint\n3.0,3.5,a\n1.0,1.2,\n", encoding="utf-8")
    first, second = true_events(read_truth(path), ("a", "b"))
    assert (first.onset_s, dict(first.required)) == (1.0, {"a": None, "b": None})
    assert dict(second.required) == {"a": None}


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("x.csv", "start,stop\n1,2\n", "lacks a column"),
        ("x.csv", "onset_s,end_s\n1,soon\n", "not a time"),
        ("x.csv", "onset_s,end_s\n2,1\n", "run forward"),
        ("x.csv", "onset_s,end_s,joint\n1,2,c\n", "not judged"),
        ("x.json", "{", "understood"),
        ("x.json", json.dumps({"rule": {}}), "understood"),
    ],
)
def test_bad_labels_are_refused_with_the_place(tmp_path: Path, name: str, text: str, words: str) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(LogError, match=words):
        true_events(read_truth(path), ("a", "b"))
    with pytest.raises(LogError):
        true_events(read_truth(tmp_path / "absent.csv"), ("a",))


def contact(onset: float, detected: float, end: float) -> Contact:
    return Contact(onset, detected, end, ("a",), "link1", "", None, "undecided", ())


def test_controller_alarms_are_agreed_missed_or_spurious() -> None:
    ours = [contact(1.0, 1.03, 1.4), contact(5.0, 5.03, 5.2)]
    time_s = np.arange(0.0, 6.0, 0.01)
    everywhere = np.ones(time_s.size, dtype=bool)
    found = compare_controller_alarms(
        [Mark(3.0, "stop"), Mark(1.01, "stop"), Mark(1.2, "stop")], ours, time_s, everywhere
    )
    assert [f.relation for f in found] == ["agreed", "spurious", "missed"]
    assert found[0].lead_s == pytest.approx(-0.02)
    assert math.isclose(found[2].detected_s or 0.0, 5.03)
    assert compare_controller_alarms([], ours, time_s, everywhere) == ()


def test_a_mark_where_nothing_was_judged_is_not_spurious() -> None:
    time_s = np.arange(0.0, 6.0, 0.01)
    marks = [Mark(2.0, "label"), Mark(4.0, "stop")]
    found = compare_controller_alarms(marks, [], time_s, time_s < 3.0)
    assert [(f.relation, f.label) for f in found] == [("spurious", "label"), ("not-judged", "stop")]
