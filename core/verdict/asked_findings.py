"""The findings as they count for what was asked: one answer for ``inspect``, ``init`` and the verdict."""

from __future__ import annotations

from collaudit.core.config.schema import Config
from collaudit.core.findings import Finding, without_errors_of
from collaudit.core.prepare.prepared import Prepared


def asked_findings(prepared: Prepared, config: Config) -> tuple[Finding, ...]:
    """The findings of a prepared log; errors of joints that are not to be judged are warnings.

    A joint is asked for when it is judged (``[robot] joints``) and watched (``[detect] watch``).

    Args:
        prepared: the log.
        config: which joints are watched.
    """
    watch = config.detect.watch
    asked = {joint for joint in prepared.judged if watch == "auto" or joint in watch}
    return without_errors_of(prepared.findings, set(prepared.series.joint_names) - asked)
