"""An audit as MCAP for viewers of robot logs, on the clock of the log: all of it, or a clip around each contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Audit, AuditResult
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.signals import Signals, State
from collaudit.core.errors import ConfigError
from collaudit.core.logs.log_formats import is_table, open_messages
from collaudit.core.logs.log_reading import sha256_of
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.reports.files.written_files import staged
from collaudit.reports.formats.ros_mcap import (
    DIAGNOSTICS,
    ERROR,
    JOINT_STATE,
    LOG,
    LOG_ERROR,
    LOG_INFO,
    LOG_WARN,
    OK,
    STALE,
    WARN,
    Channel,
    diagnostics,
    joint_states,
    log_message,
    write_mcap,
)
from collaudit.reports.sections.event_sections import contact_section, near_miss_section
from collaudit.reports.values.first_words import in_time
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import STATEMENT, verdict_word

_NANO = 1_000_000_000
_TOPIC = "/collaudit/"
#: A clip begins so long before the onset of its contact, and lasts so long after its end, s.
AROUND_S = 3.0
#: Of a state, for diagnostics; all others are out of date.
_LEVEL = {State.JUDGED: OK, State.FRICTION_INTERVAL: WARN, State.UNUSABLE: ERROR}


def write_mcap_report(path: Path, audits: Sequence[Audit], progress: Progress | None = None) -> tuple[Path, ...]:
    """Write the MCAP of one audit: another log has another clock, and needs a file of its own.

    Raises:
        ConfigError: there are several audits. CollauditError: the file cannot be written.
    """
    if len(audits) != 1:
        raise ConfigError(
            "an MCAP file holds one run, since each log has a clock of its own",
            where="--format mcap",
            found=f"{len(audits)} runs",
            hint="one collaudit report for each run",
        )
    write_audit_mcap(path, audits[0], progress)
    return (path,)


def write_audit_mcap(
    path: Path, audit: Audit, progress: Progress | None = None, recorded: Sequence[Channel] | None = None
) -> None:
    """Write the residual, thresholds, friction's range, state and events of an audit as ROS 2 messages.

    Args:
        path: the file to make.
        audit: result and signals.
        progress: called with steps done and in all.
        recorded: topics of the recording that go beside; where there are none the joints' series do. None: neither.

    Raises:
        CollauditError: the file cannot be written.
    """
    result, signals = audit.result, audit.signals
    stamps = start_ns(result.log.start) + np.round(signals.time_s * _NANO).astype(np.int64)
    channels = [
        *_series(signals, stamps),
        _states(signals, stamps),
        *_events(result, stamps),
        *(recorded or ()),
    ]
    if recorded is not None and not recorded:
        channels.append(_joints(signals, stamps))
    facts = {
        "log": visible(result.log.name),
        "log_sha256": result.log.sha256,
        "clock": "of the log" if result.log.start else "seconds from the log's first sample: it states no date",
        "verdict": verdict_word(result.verdict, result.exclusions),
        "config_sha256": result.provenance.config_sha256 or "",
        "friction_sha256": result.provenance.friction_sha256 or "",
        "statement": STATEMENT,
    }
    with staged(path) as part, part.open("wb") as file:
        write_mcap(file, channels, facts, f"collaudit {result.provenance.collaudit}", stage(progress, 0.3, 1.0))


def start_ns(start: str | None) -> int:
    """The log's first moment in nanoseconds since 1970; 0 where the log states none.

    Args:
        start: as in ``audit.json``: ISO 8601 with up to nine decimals, UTC.
    """
    if start is None:
        return 0
    whole, _, fraction = start.removesuffix("Z").partition(".")
    seconds = int(datetime.fromisoformat(f"{whole}+00:00").timestamp())
    return seconds * _NANO + int(fraction.ljust(9, "0")[:9])


def _series(signals: Signals, stamps: NDArray[np.int64]) -> list[Channel]:
    series: dict[str, NDArray[np.floating[Any]] | None] = {
        "residual": signals.residual_nm,
        "measured": signals.measured_nm,
        "model": signals.model_nm,
        "gamma": signals.gamma_nm,
        "friction_range/least": signals.least_nm,
        "friction_range/most": signals.most_nm,
    }
    made = []
    for name, values in series.items():
        if values is None:
            continue
        known = np.isfinite(values).any(axis=1) | (not name.startswith("friction_range"))
        at = stamps[known]
        made.append(Channel(_TOPIC + name, JOINT_STATE, at, joint_states(at, signals.joint_names, values[known])))
    return made


def _joints(signals: Signals, stamps: NDArray[np.int64]) -> Channel:
    """Position, velocity and measured torque of every joint."""
    messages = joint_states(
        stamps, signals.joint_names, signals.measured_nm, signals.velocity_rad_s, signals.position_rad
    )
    return Channel(f"{_TOPIC}joints", JOINT_STATE, stamps, messages)


def _states(signals: Signals, stamps: NDArray[np.int64]) -> Channel:
    """At the beginning and at each change the state of every joint that changed."""
    changed = np.ones(signals.state.shape, bool)
    changed[1:] = signals.state[1:] != signals.state[:-1]
    at = np.flatnonzero(changed.any(axis=1))
    words = {
        state.value: (_LEVEL.get(state, STALE), state.text, {"code": str(state.value), "state": state.code})
        for state in State
    }
    messages = []
    for k in at:
        joints = np.flatnonzero(changed[k])
        status = [(words[int(signals.state[k, j])], signals.joint_names[j]) for j in joints]
        messages.append(
            diagnostics(int(stamps[k]), [(level, name, text, facts) for (level, text, facts), name in status])
        )
    return Channel(f"{_TOPIC}state", DIAGNOSTICS, stamps[at], messages)


def _events(result: AuditResult, stamps: NDArray[np.int64]) -> list[Channel]:
    origin = start_ns(result.log.start)
    by_number = {record["#"]: record for record in near_miss_section(result).records}
    near = [
        (
            m.onset_s,
            LOG_WARN,
            m.joint,
            "near miss of {joint}: peak {peak}, threshold {γ}, {how close}".format_map(record),
        )
        for k, m in enumerate(in_time(result.near_misses), 1)
        for record in (by_number[str(k)],)
    ]
    said = "contact on {joints} for {lasted}: {highest residual} (γ {γ}) on {joint}, kind {kind}"
    touched = [
        (contact.onset_s, LOG_ERROR, record["joints"], said.format_map(record))
        for contact, record in zip(result.contacts, contact_section(result).records, strict=True)
    ]
    reasons = "; ".join((*result.reasons, *result.exclusions))
    said = f"{verdict_word(result.verdict, result.exclusions)}: {reasons} {STATEMENT}"
    first = (int(stamps[0]) - origin) / _NANO if len(stamps) else 0.0
    return [
        _log("contacts", touched, origin),
        _log("near_misses", near, origin),
        _log("verdict", [(first, LOG_INFO, result.log.name, said)], origin),
    ]


def _log(name: str, events: Sequence[tuple[float, int, str, str]], origin: int) -> Channel:
    ordered = sorted(events, key=lambda event: event[0])
    at = origin + np.array([round(event[0] * _NANO) for event in ordered], dtype=np.int64)
    messages = [
        log_message(int(stamp), level, visible(about), visible(text))
        for stamp, (_, level, about, text) in zip(at, ordered, strict=True)
    ]
    return Channel(_TOPIC + name, LOG, at, messages)


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
