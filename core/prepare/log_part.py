"""Stretches of a prepared log, as a log of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import Span
from collaudit.core.prepare.prepared import Prepared


def part_of(prepared: Prepared, *spans: Span) -> Prepared:
    """The samples of some spans that follow each other, with the findings and checks of the whole log."""
    series, n = prepared.series, prepared.series.time_s.size
    if sum(map(len, spans)) >= n:
        return prepared
    rows = spans[0].slice if len(spans) == 1 else np.concatenate([np.arange(s.start, s.stop) for s in spans])

    def cut(value: Any) -> Any:
        of_samples = isinstance(value, np.ndarray) and value.shape[0] == n
        return value.T[..., rows].T if of_samples else value  # columns stay contiguous

    columns: dict[str, Any] = {f.name: cut(getattr(series, f.name)) for f in fields(UniformSeries)}
    columns["segments"] = tuple(_segments_in(spans, series.segments))
    return replace(
        prepared,
        series=UniformSeries(**columns),
        rigid_nm=cut(prepared.rigid_nm),
        commanded=replace(prepared.commanded, torque_nm=cut(prepared.commanded.torque_nm)),
        phases=cut(prepared.phases),
    )


def _segments_in(spans: Sequence[Span], segments: Sequence[Span]) -> list[Span]:
    """What the spans have of each segment, where they lie one after the other."""
    found, before = list[Span](), 0
    for span in spans:
        for one in segments:
            start, stop = max(one.start, span.start), min(one.stop, span.stop)
            if start < stop:
                found.append(Span(before + start - span.start, before + stop - span.start))
        before += len(span)
    return found
