"""The scores of an audit against known events, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from collaudit.reports.terminal.text_table import table

if TYPE_CHECKING:
    from collaudit.core.data.detection_result import Score


def score_text(scores: Sequence[Score], width: int | None = None) -> str:
    """The table printed after an audit, cut to ``width``; None: any."""
    import numpy as np

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
    return table(head, lines, (1, 2, 3, 4, 5, 6, 7), width)


def _share(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.1f} %"
