"""One row of the table of nights: a joint in one log of a robot, as judged. What a store keeps (schema 4)."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Literal

import numpy as np

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.friction_model import FrictionModel

STORE_SCHEMA = 4
NightFrom = Literal["stated", "log", "audit"]


@dataclass(frozen=True, slots=True)
class JointContact:
    """A contact in which a joint alarmed.

    Attributes:
        number: of the contact in its log, from 1: rows of several joints share it.
        onset_s: s from the log's first sample.
        peak_nm: highest residual of the joint.
        place_m: (x, y, z) of the tool at the peak, in the base; None where it is not known.
        state: of the contact that night.
    """

    number: int
    onset_s: float
    peak_nm: float
    place_m: tuple[float, float, float] | None
    state: str


@dataclass(frozen=True, slots=True)
class NightRow:
    """One joint in one log; a log that could not be judged at all has one row, without a joint.

    Attributes:
        robot: whose log it is.
        night: ISO date that the log counts to; ``night_from``: stated, of the log's first stamp (UTC), or of the audit,
            where the log tells no date.
        log, log_sha256: name and hash; the hash is None where the log could not be read.
        start: ISO 8601 UTC or None.
        verdict, why: of the log, and the reasons in one text.
        joint: its name, None for a log without judged joints.
        tested: whether any of the joint's time was judged: without, no contact says nothing.
        judged_s: so much of it, s.
        level_nm: mean size of the residual away from events; None where nothing was judged.
        gamma_nm: threshold in usual motion, None without one.
        friction_nm: at the middle of the speeds that its law was measured at, as the residual followed it (the law's
            value times the level of friction in this log); None without a law.
        near_misses: of the joint.
        contacts: in which the joint alarmed.
        config_sha256, friction_sha256: what it was judged with; None for friction fitted on the log itself.
        collaudit: version.
    """

    robot: str
    night: str
    night_from: NightFrom
    log: str
    log_sha256: str | None
    start: str | None
    verdict: str
    why: str
    joint: str | None
    tested: bool
    judged_s: float
    level_nm: float | None
    gamma_nm: float | None
    friction_nm: float | None
    near_misses: int
    contacts: tuple[JointContact, ...]
    config_sha256: str | None
    friction_sha256: str | None
    collaudit: str

    @property
    def identity(self) -> tuple[str, str]:
        """Rows with this alike are of the same log: those of the later audit count."""
        return self.robot, self.log_sha256 or f"{self.night} {self.log}"


def rows_of_result(result: AuditResult, robot: str, night: str, night_from: NightFrom) -> tuple[NightRow, ...]:
    """What a store keeps of an audit, a row a joint.

    Args:
        result: of the audit.
        robot: whose log it is.
        night, night_from: the night it counts to, and who says so.
    """
    return tuple(_row(result, joint, robot, night, night_from) for joint in (*result.coverage.joints,) or (None,))


def _row(result: AuditResult, joint: str | None, robot: str, night: str, night_from: NightFrom) -> NightRow:
    coverage = None if joint is None else result.coverage.joints[joint]
    stats = None if joint is None else result.residual.get(joint)
    judged_s = coverage.judged_s if coverage is not None and coverage.watched else 0.0
    return NightRow(
        robot=robot,
        night=night,
        night_from=night_from,
        log=result.log.name,
        log_sha256=result.log.sha256,
        start=result.log.start,
        verdict=result.verdict,
        why="; ".join(result.reasons),
        joint=joint,
        tested=judged_s > 0.0,
        judged_s=judged_s,
        level_nm=None if stats is None else stats.clean_mean_abs_nm,
        gamma_nm=None if joint is None else result.rule.gamma_nm.get(joint),
        friction_nm=None if joint is None else _friction_nm(result, joint),
        near_misses=sum(near.joint == joint for near in result.near_misses),
        contacts=tuple(
            JointContact(
                number,
                contact.onset_s,
                contact.peak_nm.get(joint, 0.0),
                None if contact.scene is None else contact.scene.points_m[-1],
                contact.state,
            )
            for number, contact in enumerate(result.contacts, 1)
            if joint is not None and joint in contact.joints
        ),
        config_sha256=result.provenance.config_sha256,
        friction_sha256=result.provenance.friction_sha256,
        collaudit=result.provenance.collaudit,
    )


def _friction_nm(result: AuditResult, joint: str) -> float | None:
    fit: FrictionFit | None = result.friction.get(joint)
    law = None if fit is None else FrictionModel.of(fit)
    if law is None or law.speed_range[0] <= 0:
        return None
    speed = sqrt(law.speed_range[0] * law.speed_range[1])
    facts = None if result.detection is None else result.detection.friction_level.get(joint)
    level = 1.0 if facts is None or facts.mean is None else facts.mean
    return level * float(np.mean(np.abs(law.torque(np.array([speed, -speed])))))
