"""Kinds of contact against the truth of polishing: its own contact is commanded, the pushes are accidental."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from origins import NOBODY

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.detection_result import Contact
from collaudit.core.prepare.commanded_force import CommandedTorque


def contacts(
    log: Path, friction: FrictionFile, blind: bool, phases: bool = True, **settings: object
) -> tuple[Contact, ...]:
    """Contacts of an audit; ``blind`` as without a wrist sensor: the commanded force then stays in the residual."""
    loaded = load_config(log.with_suffix(".toml"), {k.replace("__", "."): v for k, v in settings.items()})
    prepared = prepare((log,), loaded)
    if blind:
        prepared = replace(prepared, commanded=CommandedTorque(None, ()), series=replace(prepared.series, wrench=None))
    if not phases:
        prepared = replace(prepared, phases=np.zeros_like(prepared.phases))
    found = audit_log(prepared, loaded.config, friction, NOBODY, siblings=None).result
    return found.contacts


def is_push(log: Path, contact: Contact) -> bool:
    truth = json.loads(log.with_suffix(".truth.json").read_text(encoding="utf-8"))
    pushes = [p for kind in ("collisions", "near_misses", "below_threshold") for p in truth[kind]]
    return any(p["onset_s"] - 0.1 <= contact.onset_s <= p["onset_s"] + p["duration_s"] + 0.3 for p in pushes)


def test_pushes_during_polishing_are_accidental(polishing: Path, friction: FrictionFile) -> None:
    found = contacts(polishing, friction, blind=False)
    assert len(found) == 2
    for contact in found:
        assert is_push(polishing, contact)
        assert contact.kind == "accidental"
        assert any("measured and taken out" in text for text in contact.evidence)


def test_polishing_itself_is_commanded_and_never_accidental(polishing: Path, friction: FrictionFile) -> None:
    """Without a sensor, and at a low threshold on all joints, the commanded force itself alarms."""
    joints = [f"joint{k}" for k in range(1, 7)]
    found = contacts(polishing, friction, blind=True, detect__watch=joints, detect__gamma_nm=2.0)
    polished = [i for i in found if not is_push(polishing, i)]
    in_contact = [i for i in polished if 25.0 <= i.onset_s <= 53.0]
    assert sum(i.kind == "meant" for i in in_contact) >= 0.4 * len(in_contact) > 0
    assert not any(i.kind == "accidental" for i in in_contact)
    assert not any(i.kind == "meant" for i in found if is_push(polishing, i))
    assert all(i.evidence for i in found)


def test_nothing_is_called_commanded_where_no_phases_are_known(polishing: Path, friction: FrictionFile) -> None:
    """Slow and smooth is also what a clamp, or an error of the model, looks like."""
    joints = [f"joint{k}" for k in range(1, 7)]
    found = contacts(polishing, friction, blind=True, phases=False, detect__watch=joints, detect__gamma_nm=2.0)
    assert len(found) > 3
    assert {contact.kind for contact in found} <= {"accidental", "undecided"}
    assert all("no phases are known" in contact.evidence[-1] for contact in found)
