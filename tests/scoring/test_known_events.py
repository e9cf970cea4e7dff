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
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.detection_result import DetectionFacts
from collaudit.core.data.joint_log import Annotation
from collaudit.core.errors import ConfigError
from collaudit.core.prepare.phases import PHASES, logged_phases, phase_findings
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.scoring.known_events import known_contact_times

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


def audited(log: Path, prepared: Prepared, friction: FrictionFile, labels: list[Annotation], *true: str) -> AuditResult:
    config = load_config(log.with_suffix(".toml"), {"detect.true_events": list(true)}).config
    labelled = replace(prepared, series=replace(prepared.series, annotations=tuple(labels)))
    return audit_log(labelled, config, friction, NOBODY, siblings=None).result


def facts(
    log: Path, prepared: Prepared, friction: FrictionFile, labels: list[Annotation], *true: str
) -> DetectionFacts:
    found = audited(log, prepared, friction, labels, *true).detection
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
    result = audited(hits, prepared, friction, [Annotation("collision", FLAGS, flags)])
    found = result.detection
    assert found is not None
    relations = [f.relation for f in found.flags]
    assert relations.count("agreed") == 1
    assert relations.count("spurious") == 1
    assert relations.count("missed") == len(result.contacts) - 1
    assert found.scores == ()


def test_an_absent_label_is_no_label_and_is_said_once(hits: Path, prepared: Prepared, friction: FrictionFile) -> None:
    config = load_config(hits.with_suffix(".toml"), {"detect.true_events": ["contact"]}).config
    result = audit_log(prepared, config, friction, NOBODY, siblings=None).result
    said = [found.text for found in result.findings if found.code == "log-label-missing"]
    assert len(said) == 1
    assert "contact" in said[0]
    assert result.detection is not None
    assert result.detection.scores == ()
    strict = load_config(hits.with_suffix(".toml"), {"detect.true_events": ["contact"], "fit.contact": "labelled"})
    with pytest.raises(ConfigError, match="labelled"):
        known_contact_times([prepared], strict.config, [])
    assert known_contact_times([prepared], config, []) == [None]  # to be looked for, not "free of contact"


def test_a_label_that_is_never_raised_says_that_nothing_happened(
    hits: Path, prepared: Prepared, friction: FrictionFile
) -> None:
    scores = facts(hits, prepared, friction, [Annotation("contact", TRUE, ())], "contact").scores
    assert scores[0].events == 0
    assert scores[0].false_alarms == scores[0].alarms > 0


def test_events_of_joints_that_nobody_watches_could_not_be_observed(
    hits: Path, prepared: Prepared, friction: FrictionFile
) -> None:
    mark = Annotation("contact", TRUE, tuple(pushes(hits)))
    labelled = replace(prepared, series=replace(prepared.series, annotations=(mark,)))
    config = load_config(hits.with_suffix(".toml"), {"detect.true_events": [TRUE], "detect.watch": []}).config
    found = audit_log(labelled, config, friction, NOBODY, siblings=None).result.detection
    assert found is not None
    (score,) = found.scores
    assert (score.events, score.found, score.not_observable, score.recall) == (len(pushes(hits)), 0, score.events, None)


def test_phases_from_the_log() -> None:
    t = 0.1 * np.arange(100)
    stated = [
        Annotation("Approach", "/phase", ((0.0, 1.9),)),
        Annotation("2", "/phase", ((2.0, 5.0),)),
        Annotation("away", "/phase", ((5.1, 9.9),)),
    ]
    labels, findings = logged_phases(t, stated, PhasesConfig(values={"2": "contact"}))
    assert [PHASES[k] for k in labels[[0, 30, 80]]] == ["approach", "contact", "free"]
    assert [f.code for f in findings] == ["fact", "phases-unknown"]
    assert "away" in findings[1].text
    outside = PhasesConfig(force_control=[(1.0, 4.0)])
    early = [f for f in phase_findings(t, labels, outside, stated=True) if f.code == "log-label-missing"]
    assert [(f.start_s, f.end_s) for f in early] == [(1.0, pytest.approx(1.9))]


def test_phases_of_another_run_are_noticed() -> None:
    t = 0.1 * np.arange(100)
    config = PhasesConfig(contact=[(2.0, 3.0), (25.0, 53.0)])
    found = [f for f in phase_findings(t, np.zeros(100, dtype=np.int8), config) if f.code == "log-label-missing"]
    assert [(f.start_s, f.end_s) for f in found] == [(25.0, 53.0)]
