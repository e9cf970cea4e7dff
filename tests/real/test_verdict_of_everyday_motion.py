"""Everyday motion of a real arm passes at thresholds from its own evidence, and says what friction hid."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytestmark = pytest.mark.real


def test_a_ur10_passes_with_what_it_hides(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    log = data_dir / "ur10_db3" / "ur10_exciting_trajectory.db3"
    urdf = (data_dir / "urdf" / "ur10_robot.urdf").as_posix()
    Path("ur10.toml").write_text(f'[robot]\nurdf = "{urdf}"\n[detect]\ngamma_nm = "auto"\n', encoding="utf-8")
    assert cli("fit", log, "-c", "ur10.toml", "-o", "friction.json").code == 0
    judged = cli("detect", log, "-c", "ur10.toml", "--friction", "friction.json", "-o", "run")
    assert judged.code == 0, judged.out
    assert judged.out.startswith("PASS, WITH EXCLUSIONS")
    assert len(judged.out.splitlines()) < 45
    result = json.loads(Path("run/audit.json").read_text(encoding="utf-8"))
    assert any("Hidden by friction" in text and "shoulder_pan_joint" in text for text in result["exclusions"])
    for joint in result["sensitivity"]["joints"].values():
        motion = joint["motion"]
        assert motion["detectable_s"] >= 0.5 * motion["time_s"]
        assert motion["detectable_s"] + motion["hidden_s"] + motion["not_judged_s"] == pytest.approx(motion["time_s"])
        known = [level["torque_nm"] for level in joint["levels"] if level["torque_nm"] is not None]
        assert known == sorted(known)
        assert known[-1] <= joint["largest_nm"]
    tool = result["sensitivity"]["arm"][-1]
    assert tool["place"] == "tool"
    assert all(level["typical_n"] <= level["force_n"] for level in tool["levels"] if level["force_n"] is not None)
