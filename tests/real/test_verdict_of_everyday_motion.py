"""Everyday motion of a real arm would have shown the forces asked for, with and without inertials identified."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytestmark = pytest.mark.real


@pytest.mark.parametrize(
    ("arm", "estimate", "most_n"),
    [
        ("ur10", ["friction", "inertials"], (60, 80)),
        ("panda", ["friction", "inertials"], (25, 35)),
    ],
)
def test_sound_arms_would_have_noticed_what_is_asked(
    cli, data_dir: Path, arm: str, estimate: list[str], most_n
) -> None:  # type: ignore[no-untyped-def]
    log = data_dir / f"{arm}_db3" / f"{arm}_exciting_trajectory.db3"
    urdf = {"ur10": "ur10_robot.urdf", "panda": "panda.urdf"}[arm]
    assert cli("init", log, "--urdf", data_dir / "urdf" / urdf, "-o", "arm.toml").code == 0
    fitted = cli("fit", log, "-c", "arm.toml", "-o", "friction.json", "--set", f"fit.estimate={json.dumps(estimate)}")
    assert fitted.code == 0
    allow = ("--set", 'policy.same_log="allow"')  # there is one log of each arm
    judged = cli("detect", log, "-c", "arm.toml", "--friction", "friction.json", "-o", "run", *allow)
    assert judged.code == 0, judged.out
    assert judged.out.startswith("PASS, WITH EXCLUSIONS")
    assert len(judged.out.splitlines()) < 45
    sensitivity = json.loads(Path("run/audit.json").read_text(encoding="utf-8"))["sensitivity"]
    places = {force["place"]: force for force in sensitivity["forces"]}
    for place, limit in zip(("tool", "forearm"), most_n, strict=True):
        forces = [level["force_n"] for level in places[place]["levels"]]
        assert forces == sorted(forces)
        assert forces[1] < limit and places[place]["asked"]["share"] > 0.95
    for joint in sensitivity["joints"].values():
        known = [level["torque_nm"] for level in joint["levels"] if level["torque_nm"] is not None]
        assert known == sorted(known)
        assert known[-1] <= joint["largest_nm"]


def test_a_slow_log_of_a_poor_model_bounds_smoothing_too_little_to_pass(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    """Friction alone on the Panda, 30 Hz: what is left of the model leaves open how far the efforts are smoothed."""
    log, urdf = data_dir / "panda_db3" / "panda_exciting_trajectory.db3", data_dir / "urdf" / "panda.urdf"
    assert cli("init", log, "--urdf", urdf, "-o", "arm.toml").code == 0
    assert cli("fit", log, "-c", "arm.toml", "-o", "friction.json", "--set", 'fit.estimate=["friction"]').code == 0
    allow = ("--set", 'policy.same_log="allow"')
    judged = cli("detect", log, "-c", "arm.toml", "--friction", "friction.json", "-o", "run", *allow)
    assert judged.code == 3
    assert '[fit] estimate = "auto"' in judged.out  # which would
