"""Made-up audits for the report tests: one that fails, one that could not be judged, one with hostile text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from collaudit.core.data.audit_result import (
    AUDIT_SCHEMA,
    FRICTION_SCHEMA,
    Audit,
    AuditResult,
    Collision,
    Coverage,
    FrictionFile,
    JointCoverage,
    LogFacts,
    NearMiss,
    NotJudgedSpan,
    PhaseSpan,
    PolicyLimits,
    Provenance,
    RecommendedRule,
    ResidualStats,
    RuleFacts,
)
from collaudit.core.data.detection_result import Contact, ContactForce, ContactScene
from collaudit.core.data.friction_result import FrictionFit, FrictionPoint, KnownCombination
from collaudit.core.data.signals import ArmGeometry, ArmLink, Signals, State
from collaudit.core.findings import Finding
from collaudit.core.findings.finding_kinds import KINDS

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
HOSTILE = (
    "<script>document.title='owned'</script>",
    '"><img src=x onerror="document.title=\'owned\'">',
    "$\\frac{1}{$ 100 % _x^",
    "joint\u202etxt.exe\x1b[31m\x00",
    "</svg><svg onload=alert(1)>",
    "'; -- {{ 7 * 7 }} &amp; ]]>",
)
PERIOD_S = 0.002
_SHA = "0123456789abcdef" * 4


def with_alarms(result: AuditResult, alarms: Iterable[Collision]) -> AuditResult:
    """The result with other alarms of single joints, each a contact of its own."""
    alarms = tuple(alarms)
    ordered = sorted(alarms, key=lambda alarm: (alarm.onset_s, alarm.joint))
    contacts = tuple(
        Contact(c.onset_s, c.detected_s, c.onset_s + c.duration_s, (c.joint,), "", "", None, "undecided", ())
        for c in ordered
    )
    return replace(result, collisions=alarms, contacts=contacts)


def rename(audit: Audit, names: tuple[str, ...]) -> Audit:
    """The same audit with other joint names."""
    new = dict(zip(audit.signals.joint_names, names, strict=True))
    result = with_alarms(audit.result, [replace(c, joint=new[c.joint]) for c in audit.result.collisions])
    return Audit(
        result=replace(
            result,
            log=replace(result.log, joints=tuple(new.values())),
            rule=replace(
                result.rule,
                gamma_nm={new[k]: v for k, v in result.rule.gamma_nm.items()},
                near_miss_nm={new[k]: v for k, v in result.rule.near_miss_nm.items()},
                watch=tuple(new[k] for k in result.rule.watch),
            ),
            residual={new[k]: v for k, v in result.residual.items()},
            near_misses=tuple(replace(m, joint=new[m.joint]) for m in result.near_misses),
            recommended={new[k]: v for k, v in result.recommended.items()},
            friction={new[k]: v for k, v in result.friction.items()},
            coverage=replace(result.coverage, joints={new[k]: v for k, v in result.coverage.joints.items()}),
        ),
        signals=replace(audit.signals, joint_names=names),
    )


def hostile() -> Audit:
    """Every text that could come from a log or a file tries to break out of its place."""
    audit = rename(failed(n=4000), HOSTILE)
    result = audit.result
    findings = tuple(Finding("log-left-out", "warning", text, where=text, joint=text, start_s=1.0) for text in HOSTILE)
    return replace(
        audit,
        result=replace(
            result,
            reasons=HOSTILE,
            log=replace(result.log, name=HOSTILE[0] + ".bag", topic=HOSTILE[1], format=HOSTILE[4]),
            findings=findings,
            provenance=replace(result.provenance, packages={HOSTILE[0]: HOSTILE[1]}),
        ),
    )


def friction_file() -> FrictionFile:
    """The friction the failed audit was judged with."""
    return FrictionFile(FRICTION_SCHEMA, _friction(), (), _provenance())


def failed(n: int = 100_000) -> Audit:
    """Six joints at 500 Hz: two collisions, three near misses, gaps, one joint not fitted, one open interval."""
    time_s = np.arange(n) * PERIOD_S
    rng = np.random.default_rng(7)
    phase = np.linspace(0, 2, len(JOINTS))
    velocity = 0.6 * np.sin(2 * np.pi * time_s[:, None] / 8 + phase)
    position = -0.6 * 8 / (2 * np.pi) * np.cos(2 * np.pi * time_s[:, None] / 8 + phase)
    model = 30 * np.cos(position) + 4 * np.tanh(velocity / 0.01)
    noise = rng.standard_normal((n, len(JOINTS)))
    residual = 0.35 * _smooth(noise) * np.array([1.0, 1.3, 0.9, 0.5, 0.4, 0.3])
    state = np.where(np.abs(velocity) < 0.03, State.FRICTION_INTERVAL, State.JUDGED).astype(np.int8)
    residual[state == State.FRICTION_INTERVAL] *= 0.2
    events = _events(n)
    for joint, at, width, height in events:
        residual[:, joint] += height * np.exp(-(((time_s - time_s[at]) / width) ** 2))
        state[at - 150 : at + 150, joint] = State.JUDGED
    state[:60] = state[-60:] = State.EDGE
    gap = slice(int(0.31 * n), int(0.33 * n))
    state[gap.start - 60 : gap.stop + 60] = State.EDGE
    state[gap] = State.GAP
    contact = slice(int(0.45 * n), int(0.75 * n))
    state[contact, 4] = State.NOT_WATCHED
    state[int(0.8 * n) : int(0.82 * n), 3] = State.TOO_FAST
    state[:, 5] = State.NO_FRICTION
    for array in (position, velocity, residual, model):
        array[gap] = np.nan
    residual[:, 5] = np.nan
    gamma = np.array([4.0, 4.0, 4.0, 2.5, 2.5, np.nan], np.float32)
    in_force = np.broadcast_to(gamma, state.shape)
    signals = Signals(
        time_s, JOINTS, position, velocity, model + residual, model, residual, state, in_force, 0.2 * gamma
    )
    return Audit(_result(signals), signals)


def passed(n: int = 20_000) -> Audit:
    """The failed audit without its events."""
    audit = failed(n)
    result = replace(
        audit.result,
        verdict="pass",
        reasons=("no collision in 31.2 s of judged motion", "coverage of every watched joint is above 80 %"),
        collisions=(),
        contacts=(),
        near_misses=(),
        log=replace(audit.result.log, name="quiet_night.mcap", format="mcap-ros2"),
    )
    return replace(audit, result=result)


def not_judged(n: int = 5_000) -> Audit:
    """Effort in an unknown unit: there is nothing to compare with a threshold."""
    audit = failed(n)
    signals = replace(
        audit.signals,
        residual_nm=np.full_like(audit.signals.residual_nm, np.nan),
        model_nm=np.full_like(audit.signals.model_nm, np.nan),
        state=np.full_like(audit.signals.state, State.NO_MODEL),
        gamma_nm=np.full(audit.signals.state.shape, np.nan, np.float32),
        near_below_nm=np.full(len(JOINTS), np.nan),
    )
    nothing = ResidualStats(None, None, None, None, 0.0)
    finding = Finding("effort-kind", "warning", "the effort of all 6 joints is in an unknown unit")
    result = replace(
        audit.result,
        verdict="not_judged",
        reasons=("the effort is not in N·m, so thresholds in N·m cannot be judged",),
        rule=replace(audit.result.rule, gamma_nm={}, watch=()),
        residual=dict.fromkeys(JOINTS, nothing),
        collisions=(),
        contacts=(),
        near_misses=(),
        recommended={},
        friction={},
        findings=(finding, *audit.result.findings),
        coverage=Coverage(
            n * PERIOD_S,
            0.0,
            {
                joint: JointCoverage(
                    False, "effort is not in N·m", 8.0, 0.0, 0.0, {State.NO_MODEL.code: n * PERIOD_S}, ()
                )
                for joint in JOINTS
            },
        ),
        log=replace(audit.result.log, name="tiago.csv", format="csv", start=None),
    )
    return Audit(result, signals)


def many_events(count: int = 300) -> Audit:
    """Far more events than anyone wants to see drawn."""
    audit = failed(20_000)
    base = audit.result.collisions[0]
    times = np.linspace(1.0, 38.0, count)
    collisions = tuple(
        replace(base, onset_s=float(t), detected_s=float(t) + 0.024, peak_nm=4.0 + 0.01 * k)
        for k, t in enumerate(times)
    )
    return replace(audit, result=with_alarms(audit.result, collisions))


def busy(count: int = 30) -> Audit:
    """A minute with many contacts of three joints each, as many near misses, and the findings of a poor model."""
    audit = failed(30_000)
    base, near = audit.result.collisions[0], audit.result.near_misses[0]
    names, times = ("shoulder_lift", "elbow", "wrist_1"), np.linspace(1.0, 57.0, count)
    points = (
        (0.0, 0.0, 0.1),
        (0.0, 0.0, 0.6),
        (0.4, 0.1, 0.9),
        (0.8, 0.2, 0.7),
        (0.9, 0.2, 0.6),
        (1.0, 0.2, 0.5),
        (1.1, 0.2, 0.4),
    )
    collisions, contacts = [], []
    for k, t in enumerate(times.tolist()):
        collisions += [
            replace(base, joint=j, onset_s=t + 0.03 * i, detected_s=t + 0.03 * i + 0.026, peak_nm=6.0 + 0.1 * k - i)
            for i, j in enumerate(names)
        ]
        speeds = dict.fromkeys(JOINTS, 0.31)
        scene = ContactScene(t + 0.05, points, "tool0", 0.52, speeds, dict.fromkeys(JOINTS, 0.02 * k))
        evidence = ("it rose from 10 to 90 % of its peak in 41 ms", "34 % of its variation lies above 5 Hz")
        force = ContactForce("wrist_1_link", (20.0, 3.0, 1.0), (4.0, 5.0, None), 20.3, (11.0, 54.0), (), 0.2, ())
        contacts.append(
            Contact(
                t,
                t + 0.026,
                t + 0.3,
                names,
                "wrist_1_link",
                "or further out",
                force,
                "accidental",
                evidence,
                None,
                scene,
            )
        )
    codes = (
        "effort-gain",
        "effort-kind",
        "residual-position",
        "residual-level",
        "friction-level",
        "rule-unfit",
    )
    text = "joint '{}' differs by 1.23 N·m (95 %: 1.1 to 1.4), more than a quarter of its threshold of 4 N·m"
    findings = tuple(
        Finding(code, next(s for s in ("warning", "info") if s in KINDS[code].effects), text.format(joint), joint=joint)
        for code in codes
        for joint in JOINTS
    )
    result = replace(
        audit.result,
        arm=arm(),
        limits=PolicyLimits(0, 10.0, 0.8),
        stated={
            "robot": "UR10e, serial 2019-0042",
            "tool": "gripper, 1.2 kg",
            "lab": "cell 3",
            "operator": "A. Example",
        },
        collisions=tuple(collisions),
        contacts=tuple(contacts),
        near_misses=tuple(replace(near, onset_s=t + 0.9, ratio=0.8 + 0.006 * k) for k, t in enumerate(times.tolist())),
        findings=(*audit.result.findings, *findings),
    )
    return replace(audit, result=result)


def arm() -> ArmGeometry:
    """A six-axis arm: DH rows as UR arms have them."""
    rows = (
        ((1, 0, 0, 0, 1, 0, 0, 0, 1), (0.0, 0.0, 0.13)),
        ((1, 0, 0, 0, 0, -1, 0, 1, 0), (0.0, 0.0, 0.0)),
        ((1, 0, 0, 0, 1, 0, 0, 0, 1), (-0.61, 0.0, 0.0)),
        ((1, 0, 0, 0, 1, 0, 0, 0, 1), (-0.57, 0.0, 0.16)),
        ((1, 0, 0, 0, 0, -1, 0, 1, 0), (0.0, -0.12, 0.0)),
        ((1, 0, 0, 0, 0, 1, 0, -1, 0), (0.0, 0.12, 0.0)),
    )
    links = [
        ArmLink(joint, k - 1, False, turn, place)
        for k, (joint, (turn, place)) in enumerate(zip(JOINTS, rows, strict=True))
    ]
    return ArmGeometry(tuple(links), 5, (0.0, 0.0, 0.2))


def _events(n: int) -> tuple[tuple[int, int, float, float], ...]:
    """(joint, sample, width in s, height in N·m)."""
    return (
        (0, int(0.14 * n), 0.06, 9.0),
        (2, int(0.62 * n), 0.15, -7.5),
        (1, int(0.5 * n), 0.05, 3.2),
        (3, int(0.9 * n), 0.008, 3.5),
        (0, int(0.7 * n), 0.05, 3.3),
    )


def _smooth(noise: np.ndarray) -> np.ndarray:
    kernel = np.hanning(41)
    kernel /= np.sqrt((kernel**2).sum())
    return np.stack([np.convolve(column, kernel, "same") for column in noise.T], axis=1)


def _result(signals: Signals) -> AuditResult:
    n = len(signals.time_s)
    recorded = n * PERIOD_S
    at = [float(signals.time_s[event[1]]) for event in _events(n)]
    moving = np.abs(signals.velocity_rad_s) >= 0.03
    seconds = ((signals.state == State.JUDGED) & moving).sum(axis=0) * PERIOD_S
    judged = dict(zip(JOINTS, seconds.tolist(), strict=True))
    result = AuditResult(
        schema=AUDIT_SCHEMA,
        verdict="fail",
        reasons=(
            "2 collisions, 0 allowed: shoulder_pan at 28.0 s, elbow at 124.0 s",
            "3 near misses",
        ),
        log=LogFacts(
            name="polishing_2024-03-12.bag",
            sha256=_SHA,
            format="ros1-bag",
            start="2024-03-12T22:04:11.250000Z",
            duration_s=recorded,
            sample_period_s=PERIOD_S,
            joints=JOINTS,
            topic="/joint_states",
            time_source="header",
        ),
        rule=RuleFacts(
            detector="direct",
            gamma_nm={"shoulder_pan": 4.0, "shoulder_lift": 4.0, "elbow": 4.0, "wrist_1": 2.5, "wrist_2": 2.5},
            n=13,
            persistence_s=0.026,
            persistence_requested_ms=25.0,
            watch=JOINTS[:5],
            near_miss_nm={"shoulder_pan": 3.2, "shoulder_lift": 3.2, "elbow": 3.2, "wrist_1": 2.0, "wrist_2": 2.0},
            near_miss_persistence=0.5,
        ),
        phases=(
            PhaseSpan("approach", 0.0, 0.45 * recorded),
            PhaseSpan("contact", 0.45 * recorded, 0.75 * recorded),
            PhaseSpan("retreat", 0.75 * recorded, recorded),
        ),
        residual={
            joint: ResidualStats(
                *(level / (k + 1) for level in (0.29, 0.36, 0.97, 9.3)),
                judged[joint],
                0.27 / (k + 1),
                0.9 * judged[joint],
            )
            if joint != "wrist_3"
            else ResidualStats(None, None, None, None, 0.0)
            for k, joint in enumerate(JOINTS)
        },
        collisions=(),
        near_misses=(
            NearMiss("shoulder_lift", at[2] - 0.03, 0.05, 3.612, 4.0, 0.903, "amplitude", "contact"),
            NearMiss("wrist_1", at[3] - 0.008, 0.016, 3.48, 2.5, 8 / 13, "persistence", "retreat"),
            NearMiss("shoulder_pan", at[4] - 0.02, 0.042, 3.9996, 4.0, 0.9999, "amplitude", "contact"),
        ),
        recommended=_recommended(),
        friction=_friction(),
        findings=(
            Finding("fit-doubtful", "warning", "wrist_3 never moved at constant speed", joint="wrist_3"),
            Finding("time-gap", "warning", "a gap of 4.0 s", start_s=0.31 * recorded, end_s=0.33 * recorded),
            Finding("log-clock", "info", "the header stamp is the steadier clock", where="/joint_states"),
            Finding("log-effort-missing", "error", "effort is 56.0 N·m all the time", joint="elbow"),
        ),
        coverage=_coverage(signals, judged, recorded),
        provenance=_provenance(),
    )
    alarms = (
        Collision("shoulder_pan", at[0] - 0.054, at[0] - 0.03, 0.108, 9.21734, 4.0, "approach"),
        Collision("elbow", at[1] - 0.118, at[1] - 0.094, 0.236, -7.4181, 4.0, "contact"),
    )
    return with_alarms(result, alarms)


def _provenance() -> Provenance:
    return Provenance(
        collaudit="0.1.0",
        packages={"numpy": "2.4.6", "pin": "3.4.0", "scipy": "1.16.0"},
        config_sha256=_SHA[::-1],
        friction_sha256=None,
        model_sha256=_SHA,
        logs={"identification.bag": _SHA},
    )


def _coverage(signals: Signals, judged: dict[str, float], recorded: float) -> Coverage:
    joints = {}
    for k, joint in enumerate(JOINTS):
        state = signals.state[:, k]
        not_judged = {
            s.code: float((state == s).sum() * PERIOD_S)
            for s in State
            if s > State.FRICTION_INTERVAL and (state == s).any()
        }
        standing = float((state == State.FRICTION_INTERVAL).sum() * PERIOD_S)
        joints[joint] = JointCoverage(
            watched=joint != "wrist_3",
            why="friction is known" if joint != "wrist_3" else "no friction model",
            moving_s=float((np.abs(signals.velocity_rad_s[:, k]) >= 0.03).sum() * PERIOD_S),
            judged_s=judged[joint],
            standing_s=standing,
            not_judged_s=not_judged,
            spans=(NotJudgedSpan(0.31 * recorded, 0.33 * recorded, State.GAP.code),),
        )
    return Coverage(recorded, 0.02 * recorded, joints)


def _recommended() -> dict[str, RecommendedRule]:
    good = RecommendedRule(2.2, 13, 1.1, 1.42, 0.0471, 63.6, ("at least 3 h without collisions",))
    none = RecommendedRule(None, 13, None, None, 0.0, None, ("no judged sample",))
    return {joint: none if joint == "wrist_3" else good for joint in JOINTS}


def _points(a: float, b: float, c: float, d: float, speeds: list[float]) -> tuple[FrictionPoint, ...]:
    rng = np.random.default_rng(3)
    return tuple(
        FrictionPoint(
            speed_rad_s=v,
            friction_nm=float(a + b * np.exp(-c * v) + d * v + 0.04 * rng.standard_normal()),
            sd_nm=0.12,
            se_nm=0.05,
            source="pair" if k % 4 else "model",
            direction=0 if k % 4 else 1,
            others_moving=k == 2,
        )
        for k, v in enumerate(speeds)
    )


def _friction() -> dict[str, FrictionFit]:
    speeds = [0.02, 0.04, 0.08, 0.12, 0.2, 0.3, 0.45, 0.6]
    full = FrictionFit(
        model="static-lugre",
        parameters={"A_nm": 4.1, "B_nm": 1.6, "C_s_per_rad": 14.0, "D_nm_s_per_rad": 3.2},
        ci95={
            "A_nm": (3.9, 4.3),
            "B_nm": (1.3, 1.9),
            "C_s_per_rad": (9.1, 22.0),
            "D_nm_s_per_rad": (2.8, 3.6),
        },
        covariance=(
            (0.007, -0.004, 0.1, -0.011),
            (-0.004, 0.016, 0.12, 0.005),
            (0.1, 0.12, 7.0, -0.12),
            (-0.011, 0.005, -0.12, 0.027),
        ),
        identifiable=True,
        not_identifiable=(),
        known=(),
        n_points=8,
        n_pairs=6,
        speed_range_rad_s=(0.02, 0.6),
        rmse_nm=0.041,
        effort_unit="N·m",
        points=_points(4.1, 1.6, 14.0, 3.2, speeds),
        section_count=22,
        rejected={"too short": 9, "speed not constant": 4},
    )
    opened = replace(
        full,
        ci95={**full.ci95, "C_s_per_rad": (8.2, None), "B_nm": (0.9, None)},
        covariance=None,
        identifiable=False,
        not_identifiable=("C: the slowest speed, 0.02 rad/s, is too fast to see where the exponential ends",),
        known=(KnownCombination("A", 4.1, (3.9, 4.3), "N·m"),),
    )
    simple = replace(
        full,
        model="coulomb-viscous",
        parameters={"A_nm": 5.2, "D_nm_s_per_rad": 2.1},
        ci95={"A_nm": (5.0, 5.4), "D_nm_s_per_rad": (1.6, 2.6)},
        covariance=((0.0072, -0.015), (-0.015, 0.045)),
        identifiable=False,
        not_identifiable=("B and C: over 0.02 to 0.6 rad/s the exponential cannot be told from a straight line",),
        known=(
            KnownCombination("A + B", 5.2, (5.0, 5.4), "N·m"),
            KnownCombination("D - B C", 2.1, (1.6, 2.6), "N·m·s/rad"),
        ),
        points=_points(5.2, 0.0, 1.0, 2.1, speeds),
    )
    absent = FrictionFit(
        None, {}, {}, None, False, (), (), 0, 0, None, None, "N·m", (),
        reason="no constant-velocity section: the joint moved for 0.4 s only", rejected={"too short": 3},
    )  # fmt: skip
    return dict(zip(JOINTS, (full, opened, simple, full, simple, absent), strict=True))
