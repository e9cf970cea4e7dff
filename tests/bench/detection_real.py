"""Residual levels of every detector on real logs, as in docs/evidence.md: ``python detection_real.py DATA [DOCS]``.

DATA is the folder of real logs (``ur10_db3``, ``ur3_bags``, ``panda_db3``, ``urdf``). Friction alone is fitted from the
logs named with each arm and the first of them is judged.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import tomlkit
from tables import put

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.config.schema import Config
from collaudit.core.fitting import fit_logs
from collaudit.core.residual.detector import DETECTORS

_UR = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_UR3 = dict(zip(("Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3"), _UR, strict=True))
#: Title, URDF, [log] keys, logs.
ARMS: tuple[tuple[str, str, dict[str, object], tuple[str, ...]], ...] = (
    ("UR10", "ur10_robot.urdf", {}, ("ur10_db3/ur10_exciting_trajectory.db3",)),
    (
        "UR3 id1",
        "ur3_robot.urdf",
        {
            "joint_names": {name: f"{joint}_joint" for name, joint in _UR3.items()},
            "units": {"effort_sign": {f"{joint}_joint": -1 for joint in _UR}},
        },
        ("ur3_bags/id1.bag", "ur3_bags/id2.bag"),
    ),
    (
        "Panda, 30 Hz",
        "panda.urdf",
        {"joint_names": {f"fer_joint{k}": f"panda_joint{k}" for k in range(1, 8)}},
        ("panda_db3/panda_exciting_trajectory.db3",),
    ),
)


def levels(data: Path, work: Path) -> Iterator[str]:
    """Mean |residual| over judged samples, a row a joint."""
    others = [detector.name for detector in DETECTORS if detector.name != "direct"]
    yield "| log | joint | direct | " + " | ".join(others) + " |"
    yield "|---|---|---|" + "---|" * len(others)
    for title, urdf, log, names in ARMS:
        config = work / "arm.toml"
        tables: dict[str, object] = {
            "robot": {"urdf": str(data / "urdf" / urdf)},
            "log": log,
            "fit": {"estimate": ["friction"]},
        }
        config.write_text(tomlkit.dumps(tables), encoding="utf-8")
        loaded = load_config(config)
        provenance = loaded.provenance(None, None)
        prepared = [prepare((data / name,), loaded) for name in names]
        friction = fit_logs(prepared, loaded.config, provenance)
        configs = [with_detector(loaded.config, name) for name in ("direct", *others)]
        results = [audit_log(prepared[0], config, friction, provenance).result for config in configs]
        for joint in results[0].residual:
            row = [result.residual[joint].mean_abs_nm for result in results]
            cells = " | ".join("–" if x is None else f"{x:.2f}" for x in row)
            yield f"| {title} | {joint.removesuffix('_joint').removeprefix('panda_')} | {cells} |"


def with_detector(config: Config, name: str) -> Config:
    """The configuration with another detector."""
    return config.changed({"detect": config.detect.changed({"detector": name})})


def main(arguments: list[str]) -> None:
    with tempfile.TemporaryDirectory() as work:
        lines = []
        for line in levels(Path(arguments[0]).resolve(), Path(work)):
            print(line, flush=True)
            lines.append(line)
    if len(arguments) > 1:
        put(Path(arguments[1]), "detection-real", lines)


if __name__ == "__main__":
    main(sys.argv[1:])
