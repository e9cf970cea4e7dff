"""The labelled touches on a resting Panda: all found, none false, beside the controller's own estimate."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from collaudit.core import api
from collaudit.core.config import LoadedConfig, load_config
from collaudit.core.contacts.contacts import rest_disturbances
from collaudit.core.data.detection_result import Score
from collaudit.core.detection.detector_run import DetectionInputs, run_detector
from collaudit.core.detection.fitted_rule import with_rest_thresholds
from collaudit.core.detection.rest_steps import rest_steps
from collaudit.core.detection.rule_settings import make_rule
from collaudit.core.friction.applied_friction import applied_friction

TOUCHES = (15, 16, 15, 15, 15, 16)


def settings(data_dir: Path, tmp_path: Path, effort: str) -> LoadedConfig:
    config = tmp_path / "c.toml"
    names = "\n".join(f'joint{k} = "panda_joint{k}"' for k in range(1, 8))
    columns = 'position = "q{i0}"\nvelocity = "dq{i0}"\n' + f'effort = "{effort}"'
    urdf = data_dir / "urdf" / "panda.urdf"
    config.write_text(
        f'[robot]\nurdf = "{urdf}"\n[log]\nlabels = ["label"]\n[log.joint_names]\n{names}\n[log.csv]\n{columns}\n'
        '[detect]\ntrue_events = ["label"]\n',
        encoding="utf-8",
    )
    return load_config(config)


def scores(data_dir: Path, tmp_path: Path, effort: str) -> list[tuple[Score, int]]:
    found = []
    for k in range(1, 7):
        log = data_dir / "franka_touch_csv" / f"touch_0{k}.csv"
        if not log.exists():
            pytest.skip(f"absent: {log}")
        result = api.audit(log, settings(data_dir, tmp_path, effort)).result
        assert result.detection is not None
        assert result.verdict == "fail"
        found.append((result.detection.scores[0], len(result.contacts)))
    return found


def test_every_touch_is_found_and_none_is_false(data_dir: Path, tmp_path: Path) -> None:
    found = scores(data_dir, tmp_path, "tau_J{i0}")
    assert tuple(score.found for score, _ in found) == TOUCHES
    assert tuple(contacts for _, contacts in found) == TOUCHES
    assert all(score.false_alarms == 0 for score, _ in found)
    assert np.median([delay for score, _ in found for delay in score.delay_s]) < 0.08


def test_out_of_the_box_a_resting_arm_gets_thresholds_of_its_own(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    log = data_dir / "franka_touch_csv" / "touch_06.csv"
    if not log.exists():
        pytest.skip(f"absent: {log}")
    cli("init", log, "--urdf", data_dir / "urdf" / "panda.urdf", "-o", "c.toml")
    assert 'gamma_nm = "auto"' in Path("c.toml").read_text(encoding="utf-8")
    assert cli("audit", log, "-c", "c.toml", "-o", "out").code == 1
    (found,) = Path("out").rglob("audit.json")
    assert len(json.loads(found.read_text(encoding="utf-8"))["contacts"]) == TOUCHES[-1]


@pytest.mark.parametrize("k", [2, 5])
def test_touches_disturb_an_arm_at_rest(data_dir: Path, tmp_path: Path, k: int) -> None:
    """The same touches as steps of torque against the deflection, which need no level: rest is told although the arm
    is touched most of the time."""
    log = data_dir / "franka_touch_csv" / f"touch_0{k}.csv"
    if not log.exists():
        pytest.skip(f"absent: {log}")
    given = settings(data_dir, tmp_path, "tau_J{i0}")
    prepared = api.prepare(log, given)
    series, applied = prepared.judged_series, applied_friction(prepared, None, given.config)
    config = with_rest_thresholds(given.config, applied.quiet, series.joint_names)
    rule, watch = make_rule(series, prepared.phases, config)
    inputs = DetectionInputs(applied.laws, frozenset(), rule, watch, quiet=applied.quiet)
    run = run_detector(prepared, inputs, config)
    found = rest_disturbances(rest_steps(prepared, run, replace(inputs, quiet={})), series.joint_names, ())
    touches = [span for label in series.annotations if label.name == "label" for span in label.intervals_s]
    assert len(touches) == TOUCHES[k - 1]
    told = [any(d.onset_s < end + 0.5 and start - 0.5 < d.end_s for d in found) for start, end in touches]
    assert sum(told) >= len(touches) - 2  # beside the log's gaps filters take 75 ms to settle, which hides one
    assert all(any(d.onset_s < end + 0.7 and start - 0.7 < d.end_s for start, end in touches) for d in found)
