"""A few seconds around each contact as MCAP: what was recorded there, beside residual, threshold and model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from collaudit.core.data.audit_result import Audit
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.signals import Signals
from collaudit.core.errors import ConfigError
from collaudit.core.logs.log_formats import is_table, open_messages
from collaudit.core.logs.log_reading import sha256_of
from collaudit.reports.exports.audit_mcap import start_ns, write_audit_mcap
from collaudit.reports.exports.ros_mcap import Channel

#: Before the onset of a contact and after its end, s.
AROUND_S = 3.0
_NANO = 1_000_000_000


def write_clips(folder: Path, audit: Audit, log: Path | None = None) -> tuple[Path, ...]:
    """Write a clip for each contact.

    Args:
        folder: for the clips, made when missing.
        audit: result and signals.
        log: the recording, for its topics; of another format than messages it adds nothing to the joints' series.

    Returns:
        The files, in order of time.

    Raises:
        ConfigError: the recording is not the one that was audited. LogError: it cannot be read.
        CollauditError: a file cannot be written.
    """
    result = audit.result
    origin = start_ns(result.log.start)
    spans = [(contact.onset_s - AROUND_S, contact.end_s + AROUND_S) for contact in result.contacts]
    windows = [(origin + round(a * _NANO), origin + round(b * _NANO)) for a, b in spans]
    recorded: Sequence[Sequence[Channel]] = [[] for _ in spans]
    if log is not None:
        if sha256_of((log,)) != result.log.sha256:
            raise ConfigError(
                "this is not the recording that was audited",
                where=f"--log {log}",
                expected=f"the file with sha256 {result.log.sha256}",
            )
        recorded = recorded if is_table(log) else _recorded(log, windows)
    made = []
    for number, (contact, span, topics) in enumerate(zip(result.contacts, spans, recorded, strict=True), 1):
        path = folder / f"contact-{number}-{contact.id or 'unnamed'}.mcap"
        write_audit_mcap(path, _clip(audit, contact, span), recorded=topics)
        made.append(path)
    return tuple(made)


def _clip(audit: Audit, contact: Contact, span: tuple[float, float]) -> Audit:
    """The audit of a few seconds: its signals, the one contact with its alarms, near misses in it."""
    signals, (start, end) = audit.signals, span
    rows = (signals.time_s >= start) & (signals.time_s <= end)
    cut: dict[str, Any] = {
        one.name: value[rows]
        for one in fields(Signals)
        if isinstance(value := getattr(signals, one.name), np.ndarray) and value.shape[0] == rows.size
    }
    result = replace(
        audit.result,
        contacts=(contact,),
        near_misses=tuple(near for near in audit.result.near_misses if start <= near.onset_s <= end),
    )
    return Audit(result, replace(signals, **cut))


def _recorded(log: Path, windows: Sequence[tuple[int, int]]) -> list[list[Channel]]:
    """Of each window the messages of every topic in it, as they were recorded."""
    reader = open_messages((log,))
    try:
        kinds = {channel.key: channel for channel in reader.channels}
        found: list[dict[int, list[tuple[int, bytes]]]] = [{} for _ in windows]
        for batch in reader.batches():
            for window, (first, last) in zip(found, windows, strict=True):
                for k in np.flatnonzero((batch.log_ns >= first) & (batch.log_ns <= last)).tolist():
                    window.setdefault(batch.key, []).append((int(batch.log_ns[k]), batch.payload(k)))
    finally:
        reader.close()
    clips = []
    for window in found:
        channels = []
        for key, messages in sorted(window.items()):
            kind, ordered = kinds[key], sorted(messages, key=lambda message: message[0])
            stamps = np.array([stamp for stamp, _ in ordered], dtype=np.int64)
            schema = (kind.schema_encoding, kind.schema) if kind.schema else None
            payloads = [data for _, data in ordered]
            channels.append(Channel(kind.topic, kind.type, stamps, payloads, kind.encoding, schema))
        clips.append(channels)
    return clips
