"""Moments as text: of the wall clock, where the log tells it."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from collaudit.reports.values.words import NONE


def clock_text(start: str | None, seconds: float) -> str:
    """The UTC time so many seconds after a log's start.

    Args:
        start: ISO 8601, or None where the log does not tell.
        seconds: from the log's first sample.

    Returns:
        Date and time to the millisecond, or a dash.
    """
    if start is None:
        return NONE
    try:
        moment = datetime.fromisoformat(start)
        moment = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).astimezone(UTC) + timedelta(seconds=seconds)
    except (ValueError, OverflowError):
        return NONE
    return f"{moment:%Y-%m-%d %H:%M:%S}.{moment.microsecond // 1000:03d} UTC"
