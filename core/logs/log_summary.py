"""What `inspect` says about a log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import median_of
from collaudit.core.vendors.vendor_words import SignalRole


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """One topic (or, of a CSV, the table of joint signals).

    Attributes:
        name: topic name.
        type: message type.
        encoding: ``cdr``, ``ros1``, ``json`` …
        count: messages.
        rate_hz: 1 / median step of the time of recording; None with fewer than two messages.
        joints: joint names met, in the log's order.
        largest_gap_s: longest step; None with fewer than two messages.
        has_position, has_velocity, has_effort: whether there are values; None where the question makes no sense.
        role: what the topic can serve as.
        readable: whether its messages can be decoded.
        note: which profile reads it, or why it is not read.
        currents: whether their efforts are currents of the drives, A, by the messages themselves.
        effort_noise: of joint states, whether their efforts have a sensor's noise; a model's are smooth.
        signal: of joint states, what its efforts are: measured or plain, desired, commanded, of a model …
        fields: of a type that no profile reads, keys of ``[log.fields]`` that its first message suggests.
        time_unit: of a table's stamps, as the motion tells it, where it must be stated.
    """

    name: str
    type: str
    encoding: str
    count: int
    rate_hz: float | None
    joints: tuple[str, ...] = ()
    largest_gap_s: float | None = None
    has_position: bool | None = None
    has_velocity: bool | None = None
    has_effort: bool | None = None
    role: Literal["joint_states", "wrench", "label", "phase", "other"] = "other"
    readable: bool = True
    note: str = ""
    currents: bool = False
    effort_noise: bool | None = None
    signal: SignalRole = "plain"
    fields: Mapping[str, str | list[str]] = field(default_factory=dict)
    time_unit: str | None = None


@dataclass(frozen=True, slots=True)
class ColumnInfo:
    """One column of a table.

    Attributes:
        name: as the file has it; its number from 1 in a table without names.
        unit: stated in its name, or guessed (then with a question mark); "" unknown.
        min, max: of its numbers; None without.
        changes: how often its number differs from the row before; None for text.
        role: the signal it is taken as; with a question mark what its numbers look like, which is not used.
        joint: whose signal it is, "" for none.
        why: the evidence for the role.
        file: it stands in.
    """

    name: str
    unit: str
    min: float | None
    max: float | None
    changes: int | None
    role: str
    joint: str
    why: str
    file: str


@dataclass(frozen=True, slots=True)
class LogSummary:
    """What is in a log.

    Attributes:
        name: file name without its folder (several files joined by ``+``).
        format: ``csv``, ``mcap-ros2``, ``mcap-ros1``, ``ros1-bag``, ``ros2-db3`` …
        size_bytes: of all files.
        start_ns: first time of recording since the epoch, None when unknown.
        duration_s: first to last message or row; None when there is none.
        topics: sorted by name.
        csv_columns: column names of a CSV.
        findings: what reading showed.
        columns: what each column of a table may be.
    """

    name: str
    format: str
    size_bytes: int
    start_ns: int | None
    duration_s: float | None
    topics: tuple[TopicInfo, ...]
    csv_columns: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    columns: tuple[ColumnInfo, ...] = ()


def rate_and_gap(time_s: FloatArray) -> tuple[float | None, float | None]:
    """1 / median step in Hz and the longest step in s of sorted times; None where there are too few."""
    steps = np.diff(time_s)
    if not steps.size or not np.isfinite(steps).all():
        return None, None
    middle = median_of(steps)
    return (1.0 / middle if middle > 0 else None), float(steps.max())
