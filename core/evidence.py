"""An audit with the signals it rests on."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.result import AuditResult
from collaudit.core.signals import Signals


@dataclass(frozen=True, slots=True, eq=False)
class Audit:
    """One audited log: the result, and the sample-by-sample evidence behind it."""

    result: AuditResult
    signals: Signals
