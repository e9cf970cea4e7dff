"""True events of a simulated log whose pushes are well above gamma for long enough: those that no rule may miss."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from collaudit.core.scoring.detection_score import TrueEvent, events_of_truth


def strong_pushes(path: Path, factor: float, lasting_s: float) -> list[TrueEvent]:
    """Events of a truth file that require the joints whose true torque exceeds ``factor`` times gamma for so long."""
    truth = json.loads(path.read_text(encoding="utf-8"))
    gamma = float(truth["rule"]["gamma_nm"])
    kinds = ("collisions", "near_misses", "below_threshold")
    pushes = {push["onset_s"]: push for kind in kinds for push in truth[kind]}
    out = []
    for event in events_of_truth(truth):
        push = pushes[event.onset_s]
        strong = {
            joint: crossing
            for joint, crossing in event.required.items()
            if above_s(push["duration_s"], push["joints"][joint], gamma, factor) >= lasting_s
        }
        out.append(replace(event, required=strong))
    return out


def above_s(duration_s: float, facts: Mapping[str, Any], gamma_nm: float, factor: float) -> float:
    """Seconds a push of raised-cosine edges keeps a joint above ``factor`` times gamma.

    The length of its edges follows from its peak and the time it is above gamma itself.
    """
    peak = abs(float(facts["peak_nm"]))
    if peak <= factor * gamma_nm:
        return 0.0
    edge = (duration_s - float(facts["above_gamma_s"])) * math.pi / (2.0 * math.acos(1.0 - 2.0 * gamma_nm / peak))
    return max(0.0, duration_s - 2.0 * edge * math.acos(1.0 - 2.0 * factor * gamma_nm / peak) / math.pi)
