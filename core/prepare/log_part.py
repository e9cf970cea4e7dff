"""A stretch of a prepared log, as a log of its own."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import Span
from collaudit.core.prepare.prepared import Prepared


def part_of(prepared: Prepared, span: Span) -> Prepared:
    """The samples of a span, with the findings and checks of the whole log."""
    series, n = prepared.series, prepared.series.time_s.size
    if len(span) >= n:
        return prepared

    def cut(value: Any) -> Any:
        rows = isinstance(value, np.ndarray) and value.shape[0] == n
        return value[span.slice] if rows else value

    columns: dict[str, Any] = {f.name: cut(getattr(series, f.name)) for f in fields(UniformSeries)}
    columns["segments"] = tuple(
        Span(max(one.start, span.start) - span.start, min(one.stop, span.stop) - span.start)
        for one in series.segments
        if one.stop > span.start and one.start < span.stop
    )
    return replace(
        prepared,
        series=UniformSeries(**columns),
        rigid_nm=cut(prepared.rigid_nm),
        commanded=replace(prepared.commanded, torque_nm=cut(prepared.commanded.torque_nm)),
        phases=cut(prepared.phases),
    )
