"""True events of a labelled log: a truth file of a simulated log, or a CSV table of labels."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from collaudit.core.errors import LogError
from collaudit.core.scoring.detection_score import TrueEvent
from collaudit.core.small_files import read_small

_COLUMNS = "onset_s,end_s and optionally joint"


@dataclass(frozen=True, slots=True)
class TruthFile:
    """A truth file or table of labels as read: its path as given, and its text."""

    name: str
    text: str


def read_truth(path: Path) -> TruthFile:
    """Read a truth file (``.json``) or a table of labels (``.csv``), without looking into it.

    Raises:
        LogError: it cannot be read.
    """
    try:
        return TruthFile(str(path), read_small(path).decode("utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        raise LogError("the true events cannot be read", where=str(path), found=str(error)) from error


def true_events(truth: TruthFile, joints: Sequence[str]) -> list[TrueEvent]:
    """Events of a truth file (``.json``) or of a label table (``.csv`` with columns onset_s, end_s, joint).

    Args:
        truth: as :func:`read_truth` gives it.
        joints: judged joints; a label without a joint is required of any of them.

    Raises:
        LogError: the text is neither.
    """
    if truth.name.lower().endswith(".csv"):
        return _labels(truth, joints)
    try:
        return events_of_truth(json.loads(truth.text))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise LogError(
            "the true events cannot be understood",
            where=truth.name,
            found=f"{type(error).__name__}: {error}",
            expected=f"a truth file of collaudit simulate, or a .csv with columns {_COLUMNS}",
        ) from error


def events_of_truth(truth: Mapping[str, Any]) -> list[TrueEvent]:
    """Events of a simulated log's truth; see :func:`true_events`."""
    out = []
    for kind in ("collisions", "near_misses", "below_threshold"):
        for push in truth[kind]:
            required = {
                joint: facts["crosses_gamma_s"]
                for joint, facts in push["joints"].items()
                if facts["kind"] == "collision"
            }
            out.append(TrueEvent(push["onset_s"], push["onset_s"] + push["duration_s"], required))
    return sorted(out, key=lambda e: e.onset_s)


def _labels(truth: TruthFile, joints: Sequence[str]) -> list[TrueEvent]:
    rows = csv.DictReader(truth.text.splitlines())
    if rows.fieldnames is None or not {"onset_s", "end_s"} <= set(rows.fieldnames):
        raise LogError(
            "the label table lacks a column",
            where=truth.name,
            found=", ".join(rows.fieldnames or ()),
            expected=_COLUMNS,
        )
    out = []
    for number, row in enumerate(rows, start=2):
        try:
            onset, end = float(row["onset_s"]), float(row["end_s"])
        except (TypeError, ValueError) as error:
            raise LogError("a label is not a time", where=f"{truth.name}, line {number}", found=str(error)) from error
        joint = (row.get("joint") or "").strip()
        if joint and joint not in joints:
            raise LogError(
                "a label names a joint that is not judged",
                where=f"{truth.name}, line {number}",
                found=joint,
                expected="one of " + ", ".join(joints),
            )
        if not (math.isfinite(onset) and math.isfinite(end) and onset <= end):
            raise LogError(
                "a label does not run forward", where=f"{truth.name}, line {number}", found=f"{onset:g} to {end:g}"
            )
        out.append(TrueEvent(onset, end, dict.fromkeys([joint] if joint else joints, None), whole_arm=not joint))
    return sorted(out, key=lambda e: e.onset_s)
