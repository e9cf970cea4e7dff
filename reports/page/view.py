"""What the page shows of one audit: its sections, ready for their templates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from collaudit.core.data.audit_result import Audit, AuditResult
from collaudit.core.data.rule_study_result import RuleStudy
from collaudit.core.data.signals import Signals
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.reports.page.sections.contact_cards import ContactCards, contact_cards, drawn_contacts
from collaudit.reports.page.sections.disturbance_rows import DisturbanceRow, disturbance_rows
from collaudit.reports.page.sections.finding_groups import FindingGroup, finding_groups
from collaudit.reports.page.sections.friction_sheets import FrictionSheet, friction_sheets
from collaudit.reports.page.sections.joint_figures import Detail, JointFigures, joint_figures
from collaudit.reports.page.sections.judged_time import JudgedTime, judged_time
from collaudit.reports.page.sections.log_strip import LogStrip, log_strip
from collaudit.reports.page.sections.near_miss_ledger import LedgerRow, near_miss_ledger
from collaudit.reports.page.sections.verdict_box import VerdictBox, verdict_box
from collaudit.reports.page.study_section import StudySection, study_section
from collaudit.reports.plots.joint_trace import SignalSource, TracesInMemory
from collaudit.reports.values import rows
from collaudit.reports.values.identified import Table, identification_tables
from collaudit.reports.values.numbers import stated
from collaudit.reports.values.words import torque_unit


class StoredAudit(Protocol):
    """An audit whose signals are read when they are drawn."""

    @property
    def result(self) -> AuditResult:
        """The result."""

    @property
    def signals(self) -> SignalSource:
        """Its signals, joint by joint."""

    @property
    def study(self) -> RuleStudy | None:
        """The study of its rule, where one is."""


@dataclass(frozen=True, slots=True)
class Limits:
    """How much of one audit is drawn: cards of contacts, and detail of the curves."""

    cards: int
    detail: Detail


@dataclass(frozen=True, slots=True, eq=False)
class AuditView:
    """Everything the templates need of one audit; fields in the order of the page.

    Attributes:
        key: prefix of its anchors, unique in the page.
        end_s: time of the last sample.
        contacts, near_misses: how many, as text.
        gammas: joint and threshold as text.
    """

    key: str
    result: AuditResult
    end_s: float
    verdict: VerdictBox
    strip: LogStrip
    judged: JudgedTime
    cards: ContactCards
    ledger: tuple[LedgerRow, ...]
    disturbances: tuple[DisturbanceRow, ...]
    recommended: tuple[rows.RuleRow, ...]
    friction: tuple[FrictionSheet, ...]
    residual: tuple[rows.ResidualRow, ...]
    figures: tuple[JointFigures, ...]
    study: StudySection | None
    findings: tuple[FindingGroup, ...]
    identified: tuple[Table, ...]
    gammas: tuple[tuple[str, str], ...]

    @property
    def drawn(self) -> dict[str, JointFigures]:
        """Figures by joint."""
        return {figure.joint: figure for figure in self.figures}


def make_view(audit: Audit | StoredAudit, key: str, limits: Limits, progress: Progress | None = None) -> AuditView:
    """Draw and word one audit.

    Args:
        audit: the audit; its signals in memory or in the file of its run.
        key: prefix of its anchors, unique in the page.
        limits: how much is drawn.
        progress: called with steps done and in all.
    """
    result = audit.result
    source = TracesInMemory(audit.signals) if isinstance(audit.signals, Signals) else audit.signals
    end = result.log.duration_s if source.end_s is None else source.end_s
    contacts = drawn_contacts(result, limits.cards)
    figures = joint_figures(source, result, contacts, key, limits.detail, stage(progress, 0.0, 1.0))
    return AuditView(
        key=key,
        result=result,
        end_s=end,
        verdict=verdict_box(result),
        strip=log_strip(result, end, figures),
        judged=judged_time(result),
        cards=contact_cards(result, contacts, figures, source.force_n() if contacts else None, key),
        ledger=near_miss_ledger(result, key),
        disturbances=disturbance_rows(result, key),
        recommended=tuple(rows.rule_row(joint, rule, result) for joint, rule in result.recommended.items()),
        friction=friction_sheets(result, key),
        residual=tuple(rows.residual_row(joint, result) for joint in result.residual),
        figures=figures,
        study=study_section(audit.study),
        findings=finding_groups(result),
        identified=() if result.identification is None else identification_tables(result.identification),
        gammas=tuple(
            (joint, f"{stated(gamma)} {torque_unit(result, joint)}") for joint, gamma in result.rule.gamma_nm.items()
        ),
    )
