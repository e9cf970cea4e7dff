"""The measures behind docs/evidence.md measure what they say."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from collaudit.core.data.joint_log import JointLog, LogSource
from collaudit.fixtures.arms import robot_named


@pytest.fixture(autouse=True)
def bench(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))


@pytest.fixture(scope="module")
def moved() -> tuple[Any, JointLog, Any]:
    """An arm's model, a log of 40 s without noise, and the signals of an audit of it."""
    model = robot_named("paper6").model()
    t = np.arange(0.0, 40.0, 0.008)
    phase = np.outer(t, 0.4 + 0.11 * np.arange(6)) * 2 * np.pi * 0.5 + np.arange(6)
    rate = 2 * np.pi * 0.5 * (0.4 + 0.11 * np.arange(6))
    q, v, a = 0.5 * np.sin(phase), 0.5 * rate * np.cos(phase), -0.5 * rate**2 * np.sin(phase)
    tau = model.inverse_dynamics(q, v, a) + 2.0 * np.sign(v) + 3.0 * v
    source = LogSource("made", "0" * 64, "test", None, "column", "/t")
    log = JointLog(t, model.joint_names, q, v, tau, "Nm", None, source)
    signals = SimpleNamespace(
        time_s=t, joint_names=model.joint_names, position_rad=q, velocity_rad_s=v, measured_nm=tau,
        state=np.zeros(q.shape, dtype=np.int8),
    )  # fmt: skip
    return model, log, signals


def test_the_script_explains_an_arm_of_its_own_kind(moved: Any) -> None:
    script = import_module("plain_script")
    model, _, signals = moved
    first, rest = script.split(script.samples_of(signals, model))
    left = script.left_over(first, rest)
    for j in range(6):
        # Near a reversal the low-pass rounds the step of friction, which no regressor of the speed follows.
        fast = np.abs(rest.columns[:, j, -4]) > 0.3
        assert np.sqrt(np.mean(left[fast, j] ** 2)) < 0.03 * np.std(rest.torque_nm[:, j]) + 0.1


def test_a_push_is_as_large_as_is_said_of_it(moved: Any) -> None:
    pushes = import_module("sharp_pushes")
    model, log, signals = moved
    unit = np.array([6.0, 6.0, 4.0, 2.0, 1.0, 0.5])
    spoilt, made = pushes.with_pushes(log, SimpleNamespace(signals=signals), model, unit, np.random.default_rng(1))
    assert len(made) >= 8 and len({push.frame for push in made}) == 3
    added = np.abs(spoilt.effort - log.effort)
    for push in made:
        middle = np.searchsorted(log.time_s, push.start_s + pushes.LASTS_S / 2)
        ratio = added[middle] / unit
        assert log.joint_names[int(np.argmax(ratio))] == push.joint
        assert 0.7 < ratio.max() < 1.4  # the mean over the push is 1; poses change within it
    assert not added[log.time_s < made[0].start_s].any()


def test_a_touch_at_a_quarter_keeps_its_level_and_what_is_quiet(moved: Any) -> None:
    touches = import_module("sharp_touches")
    _, log, _ = moved
    rng = np.random.default_rng(0)
    effort = 3.0 + rng.normal(0.0, 0.05, log.effort.shape)
    spans = [(5.0, 6.0), (12.0, 12.5)]
    for start, end in spans:
        effort[(log.time_s >= start) & (log.time_s <= end), 2] += 2.0
    touched = replace(log, effort=effort)
    less = touches.scaled(touched, spans, 0.25, None)
    inside = (log.time_s > 5.1) & (log.time_s < 5.9)
    assert np.mean(less.effort[inside, 2]) == pytest.approx(3.5, abs=0.03)
    calm = touches.quiet(touched, spans)
    np.testing.assert_array_equal(less.effort[calm], effort[calm])
    noisy = touches.scaled(touched, spans, 0.25, rng)
    assert np.std(noisy.effort[inside, 0]) == pytest.approx(0.05, rel=0.35)


def test_contact_covers_the_share_that_is_said(moved: Any) -> None:
    contaminated = import_module("sharp_contaminated")
    _, log, _ = moved
    for kind in contaminated.KINDS:
        spoilt, spans = contaminated.pressed(log, np.full(6, 2.0), kind, 0.2, np.random.default_rng(3))
        changed = np.mean(np.any(spoilt.effort != log.effort, axis=1))
        assert changed == pytest.approx(0.2, abs=0.06), kind
        assert len(spans) == 1 or kind != "lasting"


def test_every_fault_changes_the_log_and_none_the_one_it_was_given(moved: Any) -> None:
    campaign, faults = import_module("spoilt_logs"), import_module("log_faults")
    model, log, _ = moved
    assert len(campaign.FAULTS) >= 60 and len({(f.kind, f.name) for f in campaign.FAULTS}) == len(campaign.FAULTS)
    kept = log.effort.copy()
    for fault in campaign.FAULTS:
        place = faults.Place((8.0,), model, robot_named("paper6").tool_frame, np.random.default_rng(2))
        if fault.change is None:
            assert fault.lacks
            continue
        spoilt = fault.change(log, place)
        same = spoilt.time_s.size == log.time_s.size and all(
            np.array_equal(getattr(spoilt, name), getattr(log, name))
            for name in ("time_s", "position_rad", "velocity_rad_s", "effort")
        )
        assert not (same and spoilt.annotations == log.annotations), fault.name
        assert fault.kind == "missing values" or np.isfinite(spoilt.effort).all(), fault.name
        assert spoilt.effort.shape == spoilt.position_rad.shape, fault.name
    np.testing.assert_array_equal(log.effort, kept)


def test_the_table_counts_every_case_once() -> None:
    campaign = import_module("spoilt_logs")
    found = {
        "paper6 | scale | × 2 | judged | auto": {"outcome": "silent", "asked": True, "force_n": 120.0},
        "paper6 | scale | × 2 | both | auto": {"outcome": "found", "asked": True, "force_n": 120.0},
        "paper6 | frozen | 1 s | both | stated": {"outcome": "stated", "asked": False, "force_n": 30.0, "new": ["x"]},
        "paper6 | frozen | 1 s | both | auto": {"outcome": "too weak", "asked": False, "force_n": 30.0, "new": []},
    }
    tables = dict(campaign.table(found))
    assert "| scale | 2 | 1 | 0 | 0 | 0 | 0 | 1 | 0 | 2 | 1 |" in tables["spoilt-class"]
    assert tables["spoilt-class"][-1] == "| **all** | 4 | 1 | 0 | 0 | 1 | 1 | 1 | 0 | 2 | 1 |"
    assert len(tables["spoilt-passes"]) == 3  # the heads, and the silent one


def test_the_logs_that_are_listed_are_there(data_dir: Path) -> None:
    listed = import_module("real_log_list")
    logs = (*listed.REAL_LOGS, *listed.TOUCH_LOGS)
    assert len({log.name for log in logs}) == len(logs)
    missing = [name for log in logs for name in (*log.judged, *log.fitted, log.robot) if not (data_dir / name).exists()]
    assert not missing


def test_the_page_counts_the_lines_that_a_user_adds() -> None:
    page = (Path(__file__).parents[2] / "docs" / "real-logs.md").read_text(encoding="utf-8")
    told = [
        line.split(" | ")[:2] for line in page.partition("## What a user adds")[2].partition("\n## ")[0].splitlines()
    ]
    told = [(row[0].removeprefix("| "), row[1]) for row in told if len(row) == 2 and row[1].strip().isdigit()]
    assert told == [(log.name, str(log.lines)) for log in import_module("real_log_list").REAL_LOGS]
