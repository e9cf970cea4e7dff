"""The evidence for each answer to a question that a draft leaves open: how well the model then explains the effort."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from collaudit.cli.drafts.config_text import Section
from collaudit.cli.drafts.trial import try_log
from collaudit.core.api import LogFiles
from collaudit.core.prepare.prepared import Prepared

#: Answers that are tried, each of which reads the log once more.
_MOST = 6


def add_choice_evidence(sections: Mapping[str, Section], text: str, files: LogFiles, place: Path) -> None:
    """Try each answer by itself and write beside it what the model says of the effort.

    It decides nothing: a heavy tool or a strange scale may speak against the right answer.

    Args:
        sections: of the draft.
        text: the draft as it stands.
        files: of the log.
        place: where the file will lie.
    """
    from collaudit.core.config import parse_config

    tried = 0
    for name, section in sections.items():
        for index, line in enumerate(section.lines):
            if not line.choice or tried == _MOST:
                continue
            tried += 1
            answer = {f"{name}.{line.key}": line.value}
            trial = try_log(files, parse_config(text, place, answer), audit=False)
            if trial.prepared is not None:
                words = _evidence(trial.prepared)
            else:
                words = "not enough by itself" if trial.obstacle is None else f"then: {trial.obstacle.message}"
            section.lines[index] = replace(line, why=f"{line.why}: {words}" if line.why else words)


def _evidence(prepared: Prepared) -> str:
    """How much of the effort's variance the model torque explains, and by which gains."""
    gains = [gain for gain in prepared.gains if gain.joint in prepared.judged]
    if not gains:
        return "no evidence: the robot has no masses, or the log too little motion"
    shares = [100 * gain.explained for gain in gains]
    known = [gain.gain for gain in gains if gain.known]
    size = f"effort per N·m of model torque {min(known):.2g} to {max(known):.2g}" if known else "no gain is shown"
    return (
        f"the model explains {np.median(shares):.0f} % of the effort (median of {len(gains)} joints, {min(shares):.0f} "
        f"to {max(shares):.0f} %), {size}"
    )
