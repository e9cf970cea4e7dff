"""The labelled touches on a resting Panda: all found, none false, beside the controller's own estimate."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from collaudit.core import api
from collaudit.core.config import LoadedConfig, load_config
from collaudit.core.data.detection_result import Score

TOUCHES = (15, 16, 15, 15, 15, 16)


def settings(data_dir: Path, tmp_path: Path, effort: str) -> LoadedConfig:
    config = tmp_path / "c.toml"
    names = "\n".join(f'joint{k} = "panda_joint{k}"' for k in range(1, 8))
    columns = 'labels = ["label"]\nposition = "q{i0}"\nvelocity = "dq{i0}"\n' + f'effort = "{effort}"'
    urdf = data_dir / "urdf" / "panda.urdf"
    config.write_text(
        f'[robot]\nurdf = "{urdf}"\n[log.joint_names]\n{names}\n[log.csv]\n{columns}\n'
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
        found.append((result.detection.scores[0], len(result.detection.incidents)))
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
