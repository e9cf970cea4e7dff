"""What the page shows of one audit: its sections, ready for their templates."""

from __future__ import annotations

from dataclasses import dataclass, replace

from markupsafe import Markup

from collaudit.core.data.audit_result import Audit, AuditResult
from collaudit.core.data.rule_study_result import RuleStudy
from collaudit.core.data.signals import Signals
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.reports.files.run_files import StoredRun
from collaudit.reports.page.sections.contact_cards import ContactCard, contact_cards
from collaudit.reports.page.sections.first_screen import Fact, LogStrip, log_strip, verdict_facts
from collaudit.reports.page.sections.friction_sheets import FrictionSheet, friction_sheets
from collaudit.reports.page.sections.joint_figures import Detail, JointFigures, joint_figures
from collaudit.reports.plots.joint_trace import TracesInMemory
from collaudit.reports.plots.study_maps import force_map_plot, plane_map
from collaudit.reports.sections.event_sections import (
    contact_section,
    detection_sections,
    disturbance_section,
    near_miss_section,
)
from collaudit.reports.sections.finding_sections import fact_lines, finding_section
from collaudit.reports.sections.identified_sections import identified_sections
from collaudit.reports.sections.judged_sections import (
    coverage_section,
    force_section,
    judged_section,
    residual_section,
    span_section,
    threshold_evidence,
)
from collaudit.reports.sections.section import Section
from collaudit.reports.sections.study_sections import study_sections
from collaudit.reports.values.contact_alarms import strongest
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import verdict_word

#: Contacts that the page lists.
MOST_CONTACTS = 500
_CONTACT = (
    "#",
    "onset",
    "wall clock",
    "lasted",
    "alarms",
    "link or further out",
    "force (95 %)",
    "tool speed",
    "kind",
    "controller",
)
_RESIDUAL = ("joint", "mean |r|", "RMS", "99 % below", "largest", "γ", "judged", "clean mean")
_SMALL = ("histogram, ±1.2 γ", "autocorrelation, to 0.5 s", "RMS over the log")
_LABEL = "Alarms and sensitivity of {} over γ and n"


@dataclass(frozen=True, slots=True, eq=False)
class AuditView:
    """Everything the templates need of one audit; fields in the order of the page.

    Attributes:
        key: prefix of its anchors, unique in the page.
        end_s: time of the last sample.
        word: the verdict in words.
    """

    key: str
    result: AuditResult
    end_s: float
    word: str
    facts: tuple[Fact, ...]
    strip: LogStrip
    judged: Section
    time: tuple[Section, ...]
    cards: tuple[ContactCard, ...]
    contacts: Section
    near_misses: Section
    disturbances: Section
    recommended: Section
    friction: tuple[FrictionSheet, ...]
    residual: Section
    figures: tuple[JointFigures, ...]
    study: StudyView | None
    detection: tuple[Section, ...]
    findings: tuple[Section, ...]
    identified: tuple[Section, ...]

    def drawings(self) -> list[tuple[str, list[Markup | None]]]:
        """Small drawings beside :attr:`residual`: of each kind its title, and one for each row."""
        small = {figure.joint: figure.small for figure in self.figures}
        none = (None,) * len(_SMALL)
        return [(title, [small.get(row[0], none)[k] for row in self.residual.rows]) for k, title in enumerate(_SMALL)]


def make_view(audit: Audit | StoredRun, key: str, detail: Detail, progress: Progress | None = None) -> AuditView:
    """Draw and word one audit.

    Args:
        audit: the audit; its signals in memory or in the file of its run.
        key: prefix of its anchors, unique in the page.
        detail: how much is drawn.
        progress: called with steps done and in all.
    """
    result = audit.result
    source = TracesInMemory(audit.signals) if isinstance(audit.signals, Signals) else audit.signals
    end = result.log.duration_s if source.end_s is None else source.end_s
    contacts = strongest(result, detail.cards)
    figures = joint_figures(source, result, contacts, key, detail, stage(progress, 0.0, 1.0))
    return AuditView(
        key=key,
        result=result,
        end_s=end,
        word=verdict_word(result.verdict, result.exclusions),
        facts=verdict_facts(result),
        strip=log_strip(result, end, figures),
        judged=judged_section(result),
        time=tuple(s for s in (coverage_section(result), force_section(result), span_section(result)) if s.rows),
        cards=contact_cards(result, contacts, figures, source.force_n() if contacts else None, key),
        contacts=contact_section(result).only(*_CONTACT),
        near_misses=near_miss_section(result),
        disturbances=disturbance_section(result),
        recommended=threshold_evidence(result),
        friction=friction_sheets(result, key),
        residual=residual_section(result).only(*_RESIDUAL),
        figures=figures,
        study=study_view(audit.study, detail.planes),
        detection=detection_sections(result),
        findings=_findings(result),
        identified=() if result.identification is None else identified_sections(result.identification),
    )


def _findings(result: AuditResult) -> tuple[Section, ...]:
    """What forbids judging or limits trust, what is worth knowing, and facts."""
    grave = [finding for finding in result.findings if finding.severity != "info"]
    other = [finding for finding in result.findings if finding.severity == "info" and not finding.is_fact]
    facts = fact_lines(result.findings)
    found = (
        finding_section("Errors forbid judging; warnings limit trust", grave),
        replace(finding_section("Worth knowing", other), folded=True),
        Section(f"{len(facts)} facts of the log, and choices that were made", (), (), facts, folded=True),
    )
    return tuple(one for one in found if one.rows or one.notes)


@dataclass(frozen=True, slots=True)
class StudyView:
    """Sections, drawings of planes by joint, and the map of the smallest noticeable force, empty without one."""

    sections: tuple[Section, ...]
    planes: tuple[tuple[str, Markup], ...]
    forces: Markup | None = None


def study_view(study: RuleStudy | None, with_planes: bool = True) -> StudyView | None:
    """What the page shows of a study; None where none was made."""
    if study is None:
        return None
    forces = None
    if study.force_map is not None:
        forces = force_map_plot(study.force_map, "Smallest force noticed at the tool, over space")
    planes = tuple(
        (joint, plane_map(plane, study.period_s, visible(_LABEL.format(joint)), study.units.get(joint, "N·m")))
        for joint, plane in study.joints.items()
        if with_planes
    )
    return StudyView(study_sections(study), planes, forces)
