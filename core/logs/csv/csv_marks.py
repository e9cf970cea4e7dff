"""Labels and phases in columns of a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from collaudit.core.data.joint_log import Annotation
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.annotations import phases_of
from collaudit.core.logs.signals.controller_flags import held
from collaudit.core.numeric.arrays import FloatArray

if TYPE_CHECKING:
    from collaudit.core.config.schema import CsvConfig

#: What a cell says while a label does not hold, in lower case.
_NO = frozenset({"", "0", "0.0", "false", "no", "off", "none", "nan", "null", "-"})


def csv_marks(
    texts: Mapping[str, tuple[str, ...]], time_s: FloatArray, settings: CsvConfig, where: str
) -> tuple[list[Annotation], list[Annotation], list[Finding]]:
    """Labels and phases of a table.

    Args:
        texts: column name to the text of each row.
        time_s: (n,) stamps; rows whose stamp is not a number mark nothing.
        settings: which columns are labels and which is the phase.
        where: the file, for findings.
    """
    asked = [*settings.labels, *([settings.phase] if settings.phase is not None else [])]
    findings = [
        Finding("log-label-missing", "warning", f"The table has no column {name!r} of labels or phases.", where=where)
        for name in asked
        if name not in texts
    ]
    if not any(name in texts for name in asked):
        return [], [], findings
    good = np.flatnonzero(np.isfinite(time_s))
    good = good[np.argsort(time_s[good], kind="stable")]
    stamps = time_s[good]
    labels = []
    for name in settings.labels:
        holds = np.array([text.strip().lower() not in _NO for text in texts.get(name, ())], dtype=np.bool_)
        if holds.any():
            labels.append(Annotation(name, where, tuple(held(stamps, holds[good]))))
    phases: list[Annotation] = []
    if settings.phase is not None and settings.phase in texts and good.size:
        words = [texts[settings.phase][k].strip() for k in good.tolist()]
        phases, said = phases_of(stamps, words, float(stamps[-1]), f"{where}, column {settings.phase}")
        findings += said
    return labels, phases, findings
