"""What a clamp inside the fitting log does to thresholds and verdict: ``python clamped_fits.py LOGS [PAGE]``.

Ten clamps on each simulated arm, of 5 to 45 % of a minute of free motion, on one joint or on all below a link. Friction
and thresholds are fitted on the clamped log; the clamped log and a free one are audited with ``gamma_nm = "auto"``.
LOGS is a folder where the logs are kept; PAGE is the page whose table ``clamped-fits`` is replaced.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from tables import put

from collaudit.core import api
from collaudit.core.audit import audit_log
from collaudit.core.config import LoadedConfig, load_config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.errors import NotJudgedError
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.prepared import Prepared, _modelled
from collaudit.core.provenance import make_provenance
from collaudit.fixtures.simulation import simulate_to

SHARES = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.3)
_RAMP = 50


def opened(folder: Path, robot: str, seed: int) -> tuple[Prepared, LoadedConfig]:
    """A minute of free motion, made unless it is there."""
    log = folder / f"{robot}-free-clean-{seed}.mcap"
    if not log.with_suffix(".toml").exists():
        folder.mkdir(parents=True, exist_ok=True)
        simulate_to("free-clean", robot, seed, "mcap", log, duration_s=60.0)
    settings = load_config(log.with_suffix(".toml"), {"detect.gamma_nm": "auto"})
    return api.prepare(log, settings), settings


def clamped(log: Prepared, settings: LoadedConfig, torque_nm: dict[int, float], start: float, share: float) -> Prepared:
    """The log with these torques on its joints for one part of its time."""
    series = log.start.series
    assert series.effort is not None
    effort, n = series.effort.copy(order="F"), series.time_s.size
    a, b = int(start * n), int((start + share) * n)
    away = np.arange(b - a)
    ramp = np.minimum(1.0, np.minimum(away + 1, b - a - away) / _RAMP)
    for joint, torque in torque_nm.items():
        effort[a:b, joint] += torque * ramp
    moved = replace(log.start, series=replace(series, effort=effort))
    return _modelled(moved, log.calibration, settings.config, None)


def thresholds(friction: FrictionFile) -> dict[str, float]:
    """By joint, at 25 ms."""
    assert friction.thresholds is not None
    joints = friction.thresholds.joints
    return {name: [x.gamma_nm for x in known.levels if x.persistence_s < 0.028][-1] for name, known in joints.items()}


def rows(folder: Path) -> Iterator[str]:
    """The table."""
    yield "| arm | clamp | torque, N·m | left out | γ, times that of the free log | clamped log | free log |"
    yield "|---|---|---|---|---|---|---|"
    rng = np.random.default_rng(0)
    for robot in ("paper6", "seven"):
        (free, settings), (other, _) = opened(folder, robot, 1), opened(folder, robot, 2)
        origin = make_provenance(settings, None, free.robot.sha256)
        usual = thresholds(fit_logs([free], settings.config, origin))
        names = list(free.judged)
        for k, share in enumerate(SHARES):
            start, top = rng.uniform(0.0, 1.0 - share), int(rng.integers(0, len(names)))
            size = {top: rng.uniform(2.0, 8.0) * usual[names[top]]}
            for joint in range(top if k % 2 else 0):
                size[joint] = rng.choice([-1, 1]) * rng.uniform(1.0, 5.0) * usual[names[joint]]
            log = clamped(free, settings, size, start, share)
            where = f"| {robot} | {100 * share:.0f} % | {', '.join(f'{names[j]} {x:.1f}' for j, x in size.items())} |"
            try:
                friction = fit_logs([log], settings.config, origin)
            except NotJudgedError:
                yield f"{where} all: mostly contact | – | no friction | no friction |"
                continue
            ratio = max(gamma / usual[name] for name, gamma in thresholds(friction).items())
            (facts,) = friction.left_out.values()
            words = [_word(audit_log(each, settings.config, friction, origin)) for each in (log, other)]
            yield f"{where} {100 * facts.share:.0f} % | {ratio:.1f} | {words[0]} | {words[1]} |"


def _word(audit: Audit) -> str:
    result = audit.result
    if result.verdict == "fail":
        return f"fail, {len(result.contacts)} contacts"
    return "pass, with exclusions" if result.exclusions and result.verdict == "pass" else result.verdict


def main(folder: Path, page: Path | None) -> None:
    """Print the table; put it into the page when one is given."""
    lines = []
    for line in rows(folder):
        print(line, flush=True)
        lines.append(line)
    if page is not None:
        put(page, "clamped-fits", lines)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
