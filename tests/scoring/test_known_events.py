"""What a log says about its own events: true events to score by, the controller's flags, its phases."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.config.schema import PhasesConfig
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.detection_result import DetectionFacts
from collaudit.core.data.joint_log import Annotation
from collaudit.core.errors import ConfigError
from collaudit.core.prepare.phases import PHASES, logged_phases, phase_findings
from collaudit.core.prepare.prepared import Prepared

TRUE, FLAGS = "/operator/contact", "/controller/collision"


@pytest.fixture(scope="module")
def prepared(hits: Path) -> Prepared:
    return prepare((hits,), load_config(hits.with_suffix(".toml")))


def pushes(log: Path, least_s: float = 0.025) -> list[tuple[float, float]]:
    """Those that hold some joint's true torque above the threshold for so long."""
    truth = json.loads(log.with_suffix(".truth.json").read_text(encoding="utf-8"))
    events = [push for kind in ("collisions", "near_misses", "below_threshold") for push in truth[kind]]
    felt = [e for e in events if any(joint["above_gamma_s"] >= least_s for joint in e["joints"].values())]
    return sorted((e["onset_s"], e["onset_s"] + e["duration_s"]) for e in felt)


def facts(
    log: Path, prepared: Prepared, friction: FrictionFile, labels: list[Annotation], *true: str
) -> DetectionFacts:
    config = load_config(log.with_suffix(".toml"), {"detect.true_events": list(true)}).config
    labelled = replace(prepared, series=replace(prepared.series, annotations=tuple(labels)))
    found = audit_log(labelled, config, friction, NOBODY).result.detection
    assert found is not None
    return found


def test_marks_in_the_log_are_scored_like_a_truth_file(hits: Path, prepared: Prepared, friction: FrictionFile) -> None:
    mark = Annotation("contact", TRUE, tuple(pushes(hits)))
    by_label = facts(hits, prepared, friction, [mark], TRUE)
    both = by_label.scores[0]
    assert both.joint is None
    assert both.events == len(pushes(hits))
    assert both.recall is not None
    assert both.recall > 0.9
    brief = facts(hits, prepared, friction, [Annotation("contact", TRUE, tuple(pushes(hits, 0.015)))], TRUE)
    assert brief.scores[0].false_alarms == 0  # the kernel can widen a hard push of 20 ms to n
    assert both.auc is not None
    assert both.auc > 0.95
    assert both.roc[0] == (0.0, 0.0)
    assert both.roc[-1] == (1.0, 1.0)
    assert by_label.flags == ()  # what is true is not a flag of the controller's
    single = by_label.scores[1:]
    assert [s.joint for s in single] == list(prepared.series.joint_names)
    assert all(s.events == 0 and s.recall is None for s in single)  # the mark does not say which joint it loads


def test_other_labels_are_the_controllers_alarms(hits: Path, prepared: Prepared, friction: FrictionFile) -> None:
    first, second, *_ = pushes(hits)
    flags = ((first[0] + 0.04, first[1]), (second[1] + 0.9, second[1] + 1.0))
    found = facts(hits, prepared, friction, [Annotation("collision", FLAGS, flags)])
    relations = [f.relation for f in found.flags]
    assert relations.count("agreed") == 1
    assert relations.count("spurious") == 1
    assert relations.count("missed") == len(found.incidents) - 1
    assert found.scores == ()


def test_an_absent_label_is_a_mistake_with_its_place(hits: Path, prepared: Prepared, friction: FrictionFile) -> None:
    with pytest.raises(ConfigError, match="true_events"):
        facts(hits, prepared, friction, [Annotation("collision", FLAGS, ())], "contact")


def test_phases_from_the_log() -> None:
    t = 0.1 * np.arange(100)
    stated = [
        Annotation("Approach", "/phase", ((0.0, 1.9),)),
        Annotation("2", "/phase", ((2.0, 5.0),)),
        Annotation("away", "/phase", ((5.1, 9.9),)),
    ]
    labels, findings = logged_phases(t, stated, PhasesConfig(values={"2": "contact"}))
    assert [PHASES[k] for k in labels[[0, 30, 80]]] == ["approach", "contact", "free"]
    assert [f.code for f in findings] == ["phases-found", "phases-unknown"]
    assert "away" in findings[1].text
    outside = PhasesConfig(force_control=[(1.0, 4.0)])
    early = [f for f in phase_findings(t, labels, outside, stated=True) if f.code == "force-outside-contact"]
    assert [(f.start_s, f.end_s) for f in early] == [(1.0, pytest.approx(1.9))]


def test_phases_of_another_run_are_noticed() -> None:
    t = 0.1 * np.arange(100)
    config = PhasesConfig(contact=[(2.0, 3.0), (25.0, 53.0)])
    found = [f for f in phase_findings(t, np.zeros(100, dtype=np.int8), config) if f.code == "phases-outside"]
    assert [(f.start_s, f.end_s) for f in found] == [(25.0, 53.0)]
