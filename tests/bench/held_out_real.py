"""Residual of time left out on real logs, by joint, of one version, and two versions side by side.

    python tests/bench/held_out_real.py measure DATA OUT.json [LOG …]
    python tests/bench/held_out_real.py table BEFORE.json AFTER.json [DOCS]

``measure`` leaves out a quarter of each log in turn, fits the rest as ``collaudit fit`` does, and takes the RMS of the
settled residual in what was left out. Only functions that every version has had are used, so that an older version's
interpreter can run it. ``table`` writes Markdown; DOCS is the page whose ``held-out-versions`` table is replaced.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

FOLDS = 4
UR3 = ("Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3")
MODEL = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
NAMES = "[log.joint_names]\n" + "".join(f'"{a}" = "{b}_joint"\n' for a, b in zip(UR3, MODEL, strict=True))
SIGNS = "[log.units]\neffort_sign = { " + ", ".join(f"{b}_joint = -1" for b in MODEL) + " }\n"
COLUMNS = '[log.csv]\ntime = "t"\n' + "".join(f'{q} = "- {{joint}}_{q}"\n' for q in ("position", "velocity", "effort"))
PANDA = "[log.joint_names]\n" + "".join(f'fer_joint{i} = "panda_joint{i}"\n' for i in range(1, 8))
UR10 = ("ur10_db3/ur10_exciting_trajectory.db3",)
BAGS = ("ur3_bags/id1.bag", "ur3_bags/id2.bag")
TX40 = ("tx40_csv/curr_data.csv", "tx40_csv/pos_read_data.csv")
GEARS = """reduction = [[32, 0, 0, 0, 0, 0], [0, 32, 0, 0, 0, 0], [0, 0, 45, 0, 0, 0],
             [0, 0, 0, -48, 0, 0], [0, 0, 0, 0, 45, 0], [0, 0, 0, 0, 32, 32]]
joint_offset_rad = [0, -1.5707963, 1.5707963, 0, 0, 0]
[log.csv]
rate_hz = 5000
position = "*pos*:Joint_{i}"
effort = "*curr*:Joint_{i}"
"""
LBR = "[log.csv]\nrate_hz = 100\n[log.units]\neffort_sign = { " + ", ".join(f"A{i} = -1" for i in range(1, 8)) + " }\n"
TIAGO = tuple(f"tiago_csv/tiago_{part}.csv" for part in ("position", "velocity", "effort"))


def estimated(*more: str) -> str:
    """The table of what is identified."""
    return "[fit]\nestimate = [" + ", ".join(f'"{name}"' for name in ("friction", *more)) + "]\n"


#: Name: logs (files of one log where the third entry says so), robot file, configuration.
LOGS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "ur10": (UR10, "ur10_robot.urdf", estimated()),
    "ur10-inertials": (UR10, "ur10_robot.urdf", estimated("inertials")),
    "panda": (("panda_db3/panda_exciting_trajectory.db3",), "panda.urdf", PANDA + estimated()),
    "ur3-id1": (BAGS[:1], "ur3_robot.urdf", NAMES + SIGNS + estimated()),
    "ur3-id2": (BAGS[1:], "ur3_robot.urdf", NAMES + SIGNS + estimated()),
    "ur3-2019": (("ur3_bags/_2019-11-27-20-59-11.bag",), "ur3_robot.urdf", NAMES + SIGNS + estimated()),
    "ur3-id12-gain": (BAGS, "ur3_robot.urdf", NAMES + SIGNS + estimated("gain")),
    "ur3-id12-everything": (BAGS, "ur3_robot.urdf", NAMES + SIGNS + estimated("inertials", "tool")),
    "tx40-inertials": (TX40, "tx40_mdh_modified.urdf", GEARS + estimated("inertials")),
    "lbr": (("lbr_csv/measurements.csv",), "med7dock.urdf", LBR + estimated()),
    "tiago-gain": (TIAGO, "tiago_no_hand.urdf", COLUMNS + '[log.units]\neffort = "raw"\n' + estimated("gain")),
}


def left_out(data: Path, name: str) -> dict[str, list[float | int | None]]:
    """RMS in N·m and number of samples by joint."""
    from collaudit.core import api
    from collaudit.core.config import load_config
    from collaudit.core.fitting import fit_logs
    from collaudit.core.friction.friction_model import FrictionModel
    from collaudit.core.friction.motion_points import settled_residual
    from collaudit.core.prepare.calibration import Calibration
    from collaudit.core.prepare.prepared import _modelled, calibrated
    from collaudit.core.provenance import make_provenance

    files, urdf, text = LOGS[name]
    paths = [str(data / file) for file in files]
    with TemporaryDirectory() as folder:
        config = Path(folder) / "c.toml"
        config.write_text(f'[robot]\nurdf = "{data.absolute() / "urdf" / urdf}"\n{text}', encoding="utf-8")
        settings = load_config(config)
    logs: list[Any] = [tuple(paths)] if files in (TIAGO, TX40) else [*paths]
    prepared = [api.prepare(log, settings) for log in logs]
    provenance = make_provenance(settings, None, prepared[0].robot.sha256)
    squares: dict[str, list[float]] = {}
    for k in range(FOLDS):
        rest, spans = [], []
        for log in prepared:
            series = log.start.series
            n = series.time_s.size
            effort = series.effort.copy(order="F")
            effort[k * n // FOLDS : (k + 1) * n // FOLDS] = np.nan
            spans.append((series.time_s[k * n // FOLDS], series.time_s[(k + 1) * n // FOLDS - 1]))
            start = replace(log.start, series=replace(series, effort=effort))
            rest.append(_modelled(start, Calibration(), settings.config, None))
        found = fit_logs(rest, settings.config, provenance)
        for log, (low, high) in zip(prepared, spans, strict=True):
            known = calibrated(log, Calibration.of(found, settings.config), settings.config)
            for joint, fit in found.joints.items():
                law = FrictionModel.of(fit)
                left = None if law is None or known.rigid_nm is None else settled_residual(known, joint, law)
                if left is not None:
                    inside = left.residual[(left.time_s >= low) & (left.time_s <= high)]
                    squares.setdefault(joint, []).extend((inside**2).tolist())
    return {joint: [float(np.sqrt(np.mean(x))) if x else None, len(x)] for joint, x in squares.items()}


def table(before: dict[str, Any], after: dict[str, Any]) -> Iterator[str]:
    """Joint by joint, before → after; an asterisk where they are not of the same samples."""
    most = max(len(row) for row in after.values())
    yield "| log | " + " | ".join(f"joint {k}" for k in range(1, most + 1)) + " |"
    yield "|---|" + "---|" * most
    for name, row in after.items():
        cells = []
        for joint, (value, count) in row.items():
            old, seen = before.get(name, {}).get(joint, (None, 0))
            mark = "" if seen == count or old is None else "*"
            none = "refused" if name not in before else "–"
            texts = [none if old is None else f"{old:.2f}", "–" if value is None else f"{value:.2f}"]
            cells.append(f"{texts[0]} → {texts[1]}{mark}")
        yield f"| {name} | " + " | ".join(cells + [""] * (most - len(cells))) + " |"


def main(arguments: list[str]) -> None:
    """As the module's first lines say."""
    if arguments[0] == "measure":
        found = {name: left_out(Path(arguments[1]), name) for name in arguments[3:] or LOGS}
        Path(arguments[2]).write_text(json.dumps(found, indent=1), encoding="utf-8")
        return
    lines = list(table(*(json.loads(Path(path).read_text(encoding="utf-8")) for path in arguments[1:3])))
    print("\n".join(lines))
    if len(arguments) > 3:
        from tables import put

        put(Path(arguments[3]), "held-out-versions", lines)


if __name__ == "__main__":
    main(sys.argv[1:])
