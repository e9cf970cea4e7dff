"""What the audit says of spoilt efforts of simulated logs: ``python effort_kinds.py [DOCS]``.

DOCS is the page whose table between ``<!-- simulated-kinds -->`` marks is replaced. Each log is 40 s of fast motion.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from coverage_logs import logged, motion, streams
from tables import put

from collaudit.core.config.schema import Config
from collaudit.core.identification.channel_audit import audit_channels
from collaudit.core.prepare.preparation import prepare
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.simulation import plan

SCENARIO, SECONDS, SEED = "free-clean", 40.0, 11
Spoilt = Callable[[np.ndarray], np.ndarray]
VARIANTS: tuple[tuple[str, Spoilt], ...] = (
    ("a torque in N·m", lambda x: x),
    ("inverted", lambda x: -x),
    ("joints 2 and 3 inverted", lambda x: x * np.where(np.isin(np.arange(x.shape[1]), (1, 2)), -1.0, 1.0)),
    ("doubled", lambda x: 2.0 * x),
    ("60 ms late", lambda x: np.concatenate([np.repeat(x[:1], 30, axis=0), x[:-30]])),
    ("all zero", np.zeros_like),
    ("in steps of 4 N·m", lambda x: np.round(x / 4.0) * 4.0),
    ("a current, constants of 6 to 14 N·m/A", lambda x: x / np.linspace(14.0, 6.0, x.shape[1])),
    (
        "the same, every other joint inverted",
        lambda x: x / np.linspace(14.0, 6.0, x.shape[1]) * (-1.0) ** np.arange(x.shape[1]),
    ),
)
CODES = ("effort-kind", "effort-filtered", "effort-delay", "effort-sign-inverted", "log-effort-missing")


def table() -> Iterator[str]:
    """One row a variant of each arm."""
    yield "| arm | effort | what is said |"
    yield "|---|---|---|"
    for robot in ("paper6", "seven"):
        arm = robot_named(robot)
        model = arm.model()
        rngs = streams(SCENARIO, SEED)
        trace = motion(plan(SCENARIO, arm, model, rngs[0], SECONDS), arm, model, None)
        log = logged(trace, arm, model, rngs[2])
        assert log.effort is not None
        for title, spoil in VARIANTS:
            prepared = prepare(replace(log, effort=spoil(log.effort)), model, Config())
            _, found = audit_channels(prepared, Config())
            said: dict[str, tuple[str, list[str]]] = {}
            for finding in (*prepared.findings, *found):
                if finding.code in CODES:
                    text = finding.text.partition(" Effort per N·m")[0].partition(" The logged velocity")[0]
                    said.setdefault(finding.code, (text, []))[1].append(finding.joint or "")
            words = [
                text if len(joints) == 1 else f"{code} on {len(joints)} joints" for code, (text, joints) in said.items()
            ]
            yield f"| {robot} | {title} | {' · '.join(words)} |"


def main(docs: Path | None) -> None:
    """Print the table; put it into the page when one is given."""
    lines = list(table())
    print("\n".join(lines))
    if docs is not None:
        put(docs, "simulated-kinds", lines)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
