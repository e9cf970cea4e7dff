"""Findings: stated facts about data quality, the table of their kinds, and what each does to a verdict.

In: what any stage noticed. Out: a Finding with its effect, and the joints it forbids judging.
Elsewhere: noticing (every stage), the verdict (verdict), showing (reports, cli).
"""

from collaudit.core.findings.finding import (
    CODES,
    Finding,
    fact,
    in_joint_units,
    joints_not_judged,
    text_in_joint_units,
    torque_unit_of,
    without_errors_of,
)

__all__ = [
    "CODES",
    "Finding",
    "fact",
    "in_joint_units",
    "joints_not_judged",
    "text_in_joint_units",
    "torque_unit_of",
    "without_errors_of",
]
