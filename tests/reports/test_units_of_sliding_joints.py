"""Tables whose columns are headed N·m say N beside the numbers of a joint that slides."""

from __future__ import annotations

from dataclasses import replace

import pytest
from residual_audits import audit_of, coloured
from samples import JOINTS, passed

from collaudit.core.api import recommend_arm
from collaudit.core.data.audit_result import Audit, Coverage
from collaudit.core.data.sensitivity_result import AskedTorque, JointSensitivity, Sensitivity
from collaudit.core.recommend.joint_thresholds import AlarmPlane
from collaudit.core.verdict.coverage import exclusions
from collaudit.reports.sections.joint_sections import plane_section
from collaudit.reports.terminal.recommendation_text import recommendation_text

SLIDES = JOINTS[0]


def sliding(audit: Audit, joint: str) -> Audit:
    units = {name: "N" if name == joint else "N·m" for name in audit.result.log.joints}
    return replace(audit, result=replace(audit.result, log=replace(audit.result.log, units=units)))


@pytest.fixture(scope="module")
def audit() -> Audit:
    return sliding(passed(), SLIDES)


def row_of(text: str, joint: str) -> str:
    return next(line for line in text.splitlines() if line.strip().startswith(joint))


def test_of_a_recommendation(audit: Audit) -> None:
    found = recommend_arm([audit])
    assert (found.units[SLIDES], found.units[JOINTS[1]]) == ("N", "N·m")
    # Half a minute supports no threshold: the table shows stated ones.
    rules = {joint: replace(rule, gamma_nm=9.5, noticed_nm=12.0) for joint, rule in found.joints.items()}
    found = replace(found, joints=rules, if_clean_nm={SLIDES: 11.0, JOINTS[1]: 11.0})
    text = recommendation_text(found, detail=True)
    slides, turns = (row_of(text, joint) for joint in JOINTS[:2])
    assert " 9.5 N " in slides and " 12 N " in slides
    assert " 9.5 " in turns and " N " not in turns
    assert f"{SLIDES} 11 N, {JOINTS[1]} 11" in text


def test_of_what_is_set() -> None:
    two = sliding(audit_of(coloured(2, 600.0, joints=2), gamma_nm=40.0), "joint1")
    found = recommend_arm([two])
    text = recommendation_text(found, detail=True)
    opinions = [line for line in text.splitlines() if line.endswith("too loose")]
    assert [line.count(" N ") for line in opinions] == [3, 0], "set, asked for, unnoticed"
    peaks = text[text.index("Highest level") :]
    assert row_of(peaks, "joint1").endswith(" N") and row_of(peaks, "joint2").endswith(" N·m")


def test_of_a_verdict() -> None:
    hidden = JointSensitivity((), 50.0, 5.0, 5.0, AskedTorque(30.0, 0.8, 8.0, 2.0, 1.0))
    sensitivity, units = Sensitivity({"lift": hidden, "elbow": hidden}), {"lift": "N", "elbow": "N·m"}
    (text,) = exclusions(Coverage(10.0, 0.0, {}), sensitivity, (), units)
    assert "30 N on lift for 2 s" in text
    assert "30 N·m on elbow for 2 s" in text


def test_of_a_plane() -> None:
    plane = AlarmPlane((2.0,) * 9, (0.1,), 60.0, ((0,),) * 9, None, None)
    section = plane_section({"lift": plane, "elbow": plane}, {"lift": "N", "elbow": "N·m"})
    assert {record["joint"]: record["γ"] for record in section.records} == {"lift": "2.00 N", "elbow": "2.00 N·m"}
