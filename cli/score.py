"""Scoring an audit of a labelled log: recall, precision, false alarms an hour, delay, area under the ROC."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collaudit.core.evidence import Audit
    from collaudit.core.scoring import Score

SCORE_SCHEMA = "collaudit/score/1"


def score_audit(audit: Audit, truth: Path) -> list[Score]:
    """Score an audit against a truth file or a table of labels; all joints combined first.

    Raises:
        LogError: the file cannot be read or understood.
    """
    import numpy as np

    from collaudit.core.scoring import Alarm, Evidence, score
    from collaudit.core.truth_events import read_events

    signals = audit.signals
    events = read_events(truth, [j for j in signals.joint_names if j in audit.result.rule.watch])
    alarms = [Alarm(c.joint, c.onset_s, c.detected_s) for c in audit.result.collisions]
    with np.errstate(invalid="ignore"):
        ratio = signals.residual_nm / signals.gamma_nm
    evidence = Evidence(signals.time_s, ratio, signals.state, signals.joint_names, audit.result.rule.n)
    return score(events, alarms, evidence)


def score_text(scores: Sequence[Score]) -> str:
    """The table printed after an audit."""
    import numpy as np

    from collaudit.reports.text import table

    lines = []
    for row in scores:
        delay = "–"
        if row.delay_s:
            low, middle, high = (1e3 * x for x in np.percentile(row.delay_s, [5, 50, 95]))
            delay = f"{middle:.0f} ({low:.0f} to {high:.0f}) ms"
        lines.append(
            (
                row.joint or "all joints",
                f"{row.found} of {row.events}",
                str(row.not_observable),
                _share(row.recall),
                _share(row.precision),
                "–" if row.false_alarms_per_hour is None else f"{row.false_alarms_per_hour:.3g}",
                delay,
                "–" if row.auc is None else f"{row.auc:.3f}",
            )
        )
    head = ("joint", "found", "not observable", "recall", "precision", "false alarms/h", "delay (5 to 95 %)", "AUC")
    return table(head, lines, numeric=(1, 2, 3, 4, 5, 6, 7))


def score_json(scores: Sequence[Score]) -> str:
    """``score.json``."""
    from collaudit.reports.encode import json_text

    return json_text({"schema": SCORE_SCHEMA, "scores": list(scores)})


def _share(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.1f} %"
