"""The planes of several logs on their page: drawn once, with all logs' alarms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from residual_audits import audit_of, coloured

from collaudit.core.data.audit_result import Audit
from collaudit.core.data.rule_study_result import STUDY_SCHEMA, RuleStudy
from collaudit.core.rule_study.joint_plane import JointSeries, joint_plane
from collaudit.reports.page.html import html_text
from collaudit.reports.page.study_section import shared_planes


def studied(seed: int, period_s: float = 0.002) -> Audit:
    residual = coloured(seed, 30.0)
    audit = audit_of(residual, name=f"log-{seed}.mcap", period_s=period_s)
    series = JointSeries(residual[:, 0], np.zeros(residual.size), np.ones(residual.size, dtype=bool), period_s, 100)
    plane = joint_plane(series, 2.0, 13, None)
    return replace(audit, study=RuleStudy(STUDY_SCHEMA, str(seed), str(seed), period_s, joints={"joint1": plane}))


def test_planes_of_two_logs_are_drawn_once() -> None:
    one, two = studied(1), studied(2)
    alone, both = html_text([one]), html_text([one, two])
    assert alone.count('class="planes"') == 1 and 'id="shared-planes"' not in alone
    assert both.count('class="planes"') == 1 and 'id="shared-planes"' in both
    assert "over 2 logs together" in both and "drawn at the head of the page" in both
    found = shared_planes([one.study, None, two.study])
    assert found is not None and "over 2 logs" in found.sections[0].title
    assert {row[0] for row in found.sections[0].rows} == {"joint1"}


def test_logs_that_cannot_be_compared_share_no_planes() -> None:
    one, other = studied(1), studied(2, 0.008)
    assert shared_planes([one.study, other.study]) is None, "another sample rate"
    assert shared_planes([one.study, None]) is None and shared_planes([]) is None
