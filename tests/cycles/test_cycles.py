"""Cycles are found by path, and what one leaves beside the others shows pushes that the model's errors hide."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from repeated_program import GAMMA, Push, judged, program

from collaudit.core.cycles.cycle_reference import _as_fast
from collaudit.core.cycles.path_place import CyclePath, Placed, SpeedClass
from collaudit.core.data.audit_result import Audit
from collaudit.core.data.joint_log import Annotation
from collaudit.core.data.signals import CycleFacts, CycleReference
from collaudit.core.numeric.arrays import Span
from collaudit.reports.files.event_recount import check_events
from collaudit.reports.files.run_files import open_run, read_reference, reference_bytes, write_run

OVERRIDES = (1.0, 0.7, 1.0)


def facts(audit: Audit) -> CycleFacts:
    assert audit.result.cycles is not None
    return audit.result.cycles


@pytest.mark.parametrize(("overrides", "wait_s"), [((1.0,), 0.0), (OVERRIDES, 0.0), (OVERRIDES, 1.5)])
def test_cycles_are_where_the_path_comes_back_whatever_the_speed(overrides: tuple[float, ...], wait_s: float) -> None:
    log, starts = program(15, overrides, wait_s)
    found = np.array(facts(judged(log)).starts_s)
    assert len(found) >= 14, "all but one that is cut at an end"
    place = np.stack([np.interp(found, log.time_s, column) for column in log.position_rad.T], axis=1)
    assert np.ptp(place, axis=0).max() < 0.01, "they begin at one place"
    if wait_s == 0.0:  # else they may begin before or after the wait
        assert (np.diff(np.searchsorted(starts, found)) == 1).all(), "one in each"
    if overrides == (1.0,):
        assert np.diff(found) == pytest.approx(6.4, abs=0.1)


def test_motion_that_never_comes_back_has_no_cycles() -> None:
    log, _ = program(1)
    assert judged(log).result.cycles is None


def test_stated_cycles_give_what_is_found() -> None:
    log, starts = program(12, OVERRIDES)
    spans = [[float(a), float(b)] for a, b in zip(starts, [*starts[1:], float(log.time_s[-1])], strict=True)]
    stated, found = facts(judged(log, cycles={"spans_s": spans})), facts(judged(log))
    assert stated.stated and not found.stated and len(stated.starts_s) == 12
    for joint, gamma in found.gamma_nm.items():
        assert stated.gamma_nm[joint] == pytest.approx(gamma, rel=0.3)
    assert judged(log, cycles={"find": "off"}).result.cycles is None


def test_the_threshold_of_the_difference_is_less_than_half_and_clean_cycles_are_silent() -> None:
    for seed in range(3):
        audit = judged(program(30, OVERRIDES, 1.0, seed=seed)[0])
        assert not audit.result.collisions
        assert facts(audit).compared == len(facts(audit).starts_s)
        for joint, gamma in facts(audit).gamma_nm.items():
            assert gamma < 0.5 * GAMMA[joint]
        assert facts(audit).spread_share["joint2"] < 0.5


def test_a_push_below_the_models_threshold_is_told_by_the_other_cycles(tmp_path: Path) -> None:
    height = 0.5 * GAMMA["joint2"]
    clean, starts = program(16, OVERRIDES)
    quiet = judged(clean, cycles={"find": "off"})
    log, _ = program(16, OVERRIDES, pushes=[Push(9, 0.1, height)])
    assert not judged(log, cycles={"find": "off"}).result.collisions and not quiet.result.collisions
    audit = judged(log)
    (alarm,) = audit.result.collisions
    assert alarm.spoke == "cycle" and alarm.joint == "joint2"
    assert alarm.peak_nm == pytest.approx(height, rel=0.2)
    assert starts[9] <= alarm.onset_s <= starts[9] + 1.6 / 0.7
    (contact,) = audit.result.contacts
    assert any("other cycles" in text for text in contact.evidence)
    write_run(tmp_path, audit, None)
    run = open_run(tmp_path)
    check_events(tmp_path, run.result, run.signals)


def test_a_push_in_every_cycle_is_said_to_be_unseen_and_told_by_the_model_above_its_threshold() -> None:
    small = judged(program(16, pushes=[Push(None, 0.1, 0.4 * GAMMA["joint2"])])[0])
    assert not small.result.collisions
    assert any("part of the reference" in text for text in facts(small).unseen)
    large = judged(program(16, pushes=[Push(None, 0.1, 3.0 * GAMMA["joint2"])])[0])
    assert len(large.result.contacts) >= 15
    assert {alarm.spoke for alarm in large.result.collisions} <= {"model", "both"}


def test_few_cycles_have_no_reference_and_that_is_said() -> None:
    few = facts(judged(program(4)[0]))
    assert few.compared == 0 and not few.gamma_nm
    assert any("have no reference" in text for text in few.unseen)


def nights(count: int, **extra: object) -> list[CycleReference]:
    """What clean nights leave, as a store gives it back."""
    kept: list[CycleReference] = []
    for night in range(count):
        audit = judged(program(10, seed=100 + night)[0], kept, **extra)
        assert audit.reference is not None
        kept.append(read_reference(reference_bytes(audit.reference), f"2026-11-{night + 1:02d}", f"{night:016x}"))
    return kept


def test_passed_nights_show_a_contact_in_every_cycle_and_count_for_the_noticed_force() -> None:
    height = 0.5 * GAMMA["joint2"]
    known = nights(5)
    assert all(np.array_equal(one.position_rad, known[0].position_rad) for one in known), "one path over the nights"
    clean = judged(program(10, seed=7)[0], known)
    assert facts(clean).nights == 5 and not clean.result.collisions
    touched = judged(program(10, seed=7, pushes=[Push(None, 0.1, height)])[0], known)
    assert len(touched.result.contacts) >= 9
    alone = judged(program(10, seed=7)[0])
    ours, theirs = (audit.result.sensitivity for audit in (clean, alone))
    assert ours is not None and theirs is not None
    without = judged(program(10, seed=7)[0], cycles={"find": "off"}).result.sensitivity
    assert without == theirs, "a reference of this very log is no evidence of what would have been noticed"
    at = {one.share: one.torque_nm for one in ours.joints["joint2"].levels}
    before = {one.share: one.torque_nm for one in theirs.joints["joint2"].levels}
    assert at[0.5] < 0.5 * before[0.5]


def test_two_cycles_are_judged_where_nights_know_the_program() -> None:
    log, _ = program(2, pushes=[Push(1, 0.1, 0.5 * GAMMA["joint2"])])
    assert [alarm.spoke for alarm in judged(log, nights(5)).result.collisions] == ["cycle"]


def test_nights_of_another_path_are_no_reference() -> None:
    moved = judged(program(10, aside_rad=0.05)[0], nights(5))
    assert facts(moved).nights == 0 and moved.reference is not None


def test_a_label_of_the_log_states_its_cycles() -> None:
    log, starts = program(8)
    spans = tuple(zip(starts.tolist(), [*starts[1:].tolist(), float(log.time_s[-1])], strict=True))
    marked = replace(log, annotations=(Annotation("picking", "column busy", spans),))
    for label in ("picking", "column busy"):
        found = facts(judged(marked, cycles={"label": label}))
        assert found.stated and found.starts_s == pytest.approx(starts, abs=0.01)
    assert judged(marked, cycles={"label": "another"}).result.cycles is None


def test_a_sample_that_goes_slower_than_its_class_is_not_compared() -> None:
    """A wait in one cycle: friction and inertia are others there."""
    places = np.arange(200.0)
    path = CyclePath(np.zeros((200, 1)), np.linspace(0.0, 1.0, 200))
    on_path = Placed((Span(0, 200),), path, np.zeros(200, np.int32), places)
    usual = SpeedClass(np.array([0]), np.array([0]), np.full(200, 100.0), [])
    speed = np.full(200, 100.0)
    speed[50:60], speed[120] = 50.0, np.nan
    expected = np.ones(200, dtype=bool)
    expected[50:60] = expected[120] = False
    np.testing.assert_array_equal(_as_fast(on_path, speed, [usual]), expected)
