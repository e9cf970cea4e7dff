"""What a result says of the log it is from."""

from __future__ import annotations

from datetime import UTC, datetime

from collaudit.core.data.audit_result import LogFacts
from collaudit.core.data.uniform_series import UniformSeries


def log_facts(series: UniformSeries) -> LogFacts:
    """What a result says of its log; units are left empty."""
    source = series.source
    start = None
    if source.start_ns is not None and source.start_ns > 0:
        seconds, nanoseconds = divmod(source.start_ns, 1_000_000_000)
        start = f"{datetime.fromtimestamp(seconds, tz=UTC):%Y-%m-%dT%H:%M:%S}.{nanoseconds:09d}Z"
    return LogFacts(
        name=source.name,
        sha256=source.sha256,
        format=source.format,
        start=start,
        duration_s=float(series.time_s[-1] - series.time_s[0]),
        sample_period_s=series.period_s,
        joints=series.joint_names,
        topic=source.topic,
        time_source=source.time_source,
    )
