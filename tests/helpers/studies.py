"""A made-up study of a rule, as large as that of a real log: ragged planes, many contacts, a map of many cells."""

from __future__ import annotations

from math import exp

import numpy as np

from collaudit.core.data.rule_study_result import (
    STUDY_SCHEMA,
    BlindPose,
    ContactSensitivity,
    ForceCell,
    ForceMap,
    ForceNoticed,
    JointPlane,
    LabelledCurve,
    Motion,
    PlanePoint,
    RuleSensitivity,
    RuleStudy,
    ThresholdParts,
)

SHAPES = {"knock 5 ms": 0.005, "knock 10 ms": 0.01, "knock 20 ms": 0.02, "push 100 ms": 0.1, "clamp 1 s": 1.0}
_CAUSES = ("noise", "reversal", "friction", "model", "ripple", "drift", "lag", "rest")


def plane(seed: int = 0) -> JointPlane:
    """100 thresholds by 50 persistences, with borders as uneven as counts make them."""
    rng = np.random.default_rng(seed)
    gamma = np.geomspace(0.1, 300.0, 100)
    n = np.unique(np.rint(np.geomspace(1, 150, 60)).astype(int))[:50]
    ragged = rng.lognormal(0.0, 0.25, (1, len(n)))
    alarms = np.rint(3000 * np.exp(-gamma[:, None] * ragged) / n).astype(int)
    torque = gamma[:, None] * (1 + n / 40) * rng.lognormal(0.0, 0.1, (1, len(n)))
    blind = torque > 250.0
    points = tuple(
        PlanePoint(float(gamma[90 - 2 * k]), int(n[k]), 2 * k, 3.0 * k, 4.0 * k + 3, float(gamma[90 - 2 * k]))
        for k in range(40)
    )
    return JointPlane(
        tuple(gamma.tolist()), tuple(n.tolist()), 0.2, tuple(map(tuple, alarms.tolist())),
        tuple(tuple(None if b else t for t, b in zip(*row, strict=True)) for row in zip(torque, blind, strict=True)),
        points[10], points[20], points,
    )  # fmt: skip


def _contact(shape: str, place: str | None, motion: Motion | None, force_n: float) -> ContactSensitivity:
    noticed = tuple(
        ForceNoticed(share, force_n * grown, (0.8 * force_n * grown, 1.7 * force_n * grown))
        for share, grown in ((0.5, 1.0), (0.9, 6.3))
    )
    return ContactSensitivity(shape, SHAPES[shape], 0.01, place, motion, 29, noticed, 0.04, 0.015)


def _rule(name: str, joints: tuple[str, ...]) -> RuleSensitivity:
    places = [f"end of {joint}" for joint in joints] + ["tool"]
    contacts = [
        _contact(shape, place, motion, 20.0 + 3.0 * k)
        for k, (place, motion) in enumerate([(None, None), (None, "moving"), (None, "standing")])
        for shape in SHAPES
    ]
    contacts += [_contact(shape, place, None, 30.0 + 7.0 * k) for k, place in enumerate(places) for shape in SHAPES]
    return RuleSensitivity(name, dict.fromkeys(joints, 4.0), 13, tuple(contacts))


def study(joints: tuple[str, ...]) -> RuleStudy:
    """Of these joints, with two rules and known contacts."""
    rng = np.random.default_rng(1)
    cells = tuple(
        ForceCell(
            (0.1 * x, 0.1 * y, 0.1 * z), 9, float(rng.lognormal(4, 0.5)) if (x + y) % 9 else None
        )
        for x in range(9) for y in range(9) for z in range(5)
    )  # fmt: skip
    blind = tuple(
        BlindPose(f"end of {j}", 46.7, "along (-0.47, -0.62, 0.63)", 6420.0, 0.37)
        for j in joints
    )  # fmt: skip
    scale = tuple(exp(0.1 * k) for k in range(-10, 30))
    injected = {force: tuple(0.5 for _ in scale) for force in ("5 N", "10 N", "20 N", "40 N")}
    curve = LabelledCurve(scale, 30, tuple(0.4 for _ in scale), tuple((0.2, 0.6) for _ in scale), injected)
    parts = ThresholdParts(2.0, dict.fromkeys(_CAUSES, 0.3))
    return RuleStudy(
        STUDY_SCHEMA, "polishing.bag", 64 * "0", 0.002,
        joints={joint: plane(k) for k, joint in enumerate(joints)},
        rules=(_rule("configured", joints), _rule("recommended", joints)),
        force_map=ForceMap(0.1, 500.0, cells, blind),
        parts=dict.fromkeys(joints, parts),
        labelled=curve,
        assumptions=4 * ("Added contacts keep the recorded motion, and act on the arm in the poses that it was in.",),
    )  # fmt: skip
