"""Evidence of nights adds up: thresholds from a store, and the night since which they are supported."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from histories import history

from collaudit.core.errors import NotJudgedError
from collaudit.core.history.log_record import LogRecord
from collaudit.core.history.stored_thresholds import stored_recommendation
from collaudit.reports.store.result_store import ResultStore

PER_HOUR = 0.1


def nights(count: int, kept: float = 1.0, seed: int = 0) -> list[LogRecord]:
    """An hour a night with a Gaussian residual's peaks, the largest share of which is kept."""
    rng = np.random.default_rng(seed)
    out = []
    for record in history("r", count, joints=("j1", "j2")):
        joints = []
        for joint in record.joints:
            level = np.abs(rng.normal(1.0, 0.1, 3600))
            order = np.argsort(-level)[: int(kept * 3600)]
            minute = tuple((order // 60).tolist())
            peaks = tuple(level[order].tolist())
            joints.append(
                replace(joint, peaks_nm=peaks, peaks_minute=minute, peaks_count=3600, minute_hours=(1 / 60,) * 60)
            )
        out.append(replace(record, joints=tuple(joints)))
    return out


def test_hours_add_up_until_the_rate_is_supported() -> None:
    few, many = (stored_recommendation(nights(count), "r", PER_HOUR) for count in (1, 5))
    assert not few.rate.supported and few.supported_since is None and few.rate.more_hours == pytest.approx(1.0)
    assert many.rate.supported and many.supported_since in many.nights[1:]
    assert many.set_supported_since is not None  # 4 N·m are far above peaks of 1.4
    for rule in many.joints.values():
        assert rule.hours == pytest.approx(5.0) and rule.largest_clean_nm <= rule.gamma_nm < 2.0


def test_the_largest_quarter_of_the_peaks_says_the_same() -> None:
    whole, kept = (stored_recommendation(nights(5, share), "r", PER_HOUR) for share in (1.0, 0.25))
    for joint, rule in whole.joints.items():
        assert kept.joints[joint].gamma_nm == pytest.approx(rule.gamma_nm, rel=0.08)


def test_nights_under_other_settings_do_not_count() -> None:
    made = nights(4)
    found = stored_recommendation([replace(made[0], friction_sha256="old"), *made[1:]], "r", PER_HOUR)
    assert found.left_out == 1 and found.joints["j1"].hours == pytest.approx(3.0)


def test_a_robot_without_nights_is_not_judged() -> None:
    with pytest.raises(NotJudgedError):
        stored_recommendation(nights(2), "other", PER_HOUR)


def test_the_command(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from collaudit.cli.main import run

    ResultStore(str(tmp_path / "store")).append(nights(4, 0.25))
    asked = ["recommend", "--store", str(tmp_path / "store"), "--per-hour", "0.1"]
    assert run(asked) == 0
    assert (
        "recommended gamma: at most 0.100 false alarms of the arm an hour supported since 2026-09-0"
        in capfd.readouterr().out
    )
    assert run([*asked, "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["rate"]["supported"] is True
    assert run(["recommend"]) == 2
