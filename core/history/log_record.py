"""What a store keeps of one judged log: the types of store schema 3. Fields are added by a new schema only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

STORE_SCHEMA = 3
NightFrom = Literal["stated", "log", "audit"]


@dataclass(frozen=True, slots=True)
class Share:
    """An estimate with its standard error; ``freedom`` is the degrees of freedom of Student's t for its interval."""

    value: float
    se: float
    freedom: float


@dataclass(frozen=True, slots=True)
class JointRecord:
    """One joint in one log; None stands for not known.

    Attributes:
        joint: its name.
        watched: whether its residual was judged.
        gamma_nm, n: rule applied.
        judged_s: seconds judged by the rule.
        detectable_s, observed_s: of ``observed_s`` seconds looked at, those in which the torque asked of the joint
            would have alarmed; ``judged_s`` where none is asked.
        clean_s: judged seconds away from events.
        rms_nm, p99_nm, clean_mean_abs_nm: level of the residual.
        gamma_margin: gamma over the largest clean level that lasted n samples.
        temperature_c: mean over the log.
        friction_excess, friction_excess_se: friction in excess of the law it was judged with, as a share of it, and its
            standard error; None where friction was fitted on the log itself or the motion does not tell, and in
            records of schema 1.
        friction_level: what the residual followed of that, as a multiple of the law; None in records of schema 1.
        load_excess, load_excess_se: the same of the rigid-body torque: another payload or tool.
        offset_nm, offset_nm_se: constant torque that is left.
        freedom: degrees of freedom of these three.
        law_nm: friction of the law at ``law_speed_rad_s``, mean of both directions.
        law_nm_low, law_nm_high: its 95 % interval; None where the fit tells none.
        law_speed_rad_s: geometric mean of the speeds that the law was measured at, in one digit.
        peaks_nm: the largest separate levels that the clean residual kept for n samples, falling.
        peaks_minute: the minute of clean time each lies in.
        peaks_count: of all peaks; those not kept are at most as large as the last of ``peaks_nm``.
        minute_hours: clean hours of each minute.
    """

    joint: str
    watched: bool
    gamma_nm: float | None
    n: int
    judged_s: float
    detectable_s: float
    observed_s: float
    clean_s: float
    rms_nm: float | None
    p99_nm: float | None
    clean_mean_abs_nm: float | None
    gamma_margin: float | None
    temperature_c: float | None
    friction_excess: float | None
    friction_excess_se: float | None
    load_excess: float | None
    load_excess_se: float | None
    offset_nm: float | None
    offset_nm_se: float | None
    freedom: float | None
    law_nm: float | None
    law_nm_low: float | None
    law_nm_high: float | None
    law_speed_rad_s: float | None
    friction_level: float | None = None
    peaks_nm: tuple[float, ...] = ()
    peaks_minute: tuple[int, ...] = ()
    peaks_count: int = 0
    minute_hours: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class ParameterRecord:
    """One parameter of a joint's friction law, as it was used; bounds are None where the data leave them open."""

    joint: str
    model: str
    parameter: str
    value: float
    ci95_low: float | None
    ci95_high: float | None
    identifiable: bool


@dataclass(frozen=True, slots=True)
class ContactRecord:
    """One contact: ``peaks_nm`` by joint in their order, ``place_m`` of the tool at the peak, ``state`` that night."""

    onset_s: float
    end_s: float
    joints: tuple[str, ...]
    link: str
    kind: str
    least_force_n: float | None
    peaks_nm: tuple[float, ...] = ()
    place_m: tuple[float, float, float] | None = None
    state: str = "new"


@dataclass(frozen=True, slots=True)
class NearMissRecord:
    """One near miss."""

    joint: str
    onset_s: float
    duration_s: float
    peak_nm: float
    ratio: float
    kind: str


@dataclass(frozen=True, slots=True)
class FindingRecord:
    """One finding."""

    code: str
    severity: str
    joint: str | None
    text: str


@dataclass(frozen=True, slots=True)
class LogRecord:
    """One log of one robot, as one audit judged it.

    Attributes:
        robot: whose log it is; records of one robot make its history.
        night: ISO date that the log counts to; ``night_from``: stated, of the log's first stamp (UTC), or of the audit,
            where the log tells no date.
        log, log_sha256: name and hash; the hash is None where the log could not be read.
        start: ISO 8601 UTC or None.
        verdict, reasons: of the audit; ``error``: why it could not be audited at all.
        duration_s, period_s: of the log.
        judged_h: hours in which at least one joint was judged, as the index page counts them.
        config_sha256, friction_sha256, model_sha256: what it was judged with; ``friction_sha256`` is None where
            friction was fitted on the log itself.
        collaudit: version.
        persistence_s: of the rule.
    """

    robot: str
    night: str
    night_from: NightFrom
    log: str
    log_sha256: str | None
    start: str | None
    verdict: str
    reasons: tuple[str, ...]
    error: str | None
    duration_s: float | None
    period_s: float | None
    judged_h: float
    detector: str | None
    persistence_s: float | None
    config_sha256: str | None
    friction_sha256: str | None
    model_sha256: str | None
    collaudit: str
    joints: tuple[JointRecord, ...] = ()
    friction: tuple[ParameterRecord, ...] = ()
    contacts: tuple[ContactRecord, ...] = ()
    near_misses: tuple[NearMissRecord, ...] = ()
    findings: tuple[FindingRecord, ...] = ()

    @property
    def identity(self) -> tuple[str, str]:
        """Two records with this alike are of the same log: the later one counts."""
        return self.robot, self.log_sha256 or f"{self.night} {self.log}"
