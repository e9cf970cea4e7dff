"""Keys that earlier versions had: what a file says that still states one."""

from __future__ import annotations

from collections.abc import Mapping

#: Dotted key, names that a user chose left out, and what to do instead.
REMOVED: Mapping[str, str] = {
    "cycles.least": "take the line out: a reference needs four other cycles, or nights",
    "detect.friction_level": "take the line out: the level of friction is always followed",
    "fleet.robots.serials": "tell the robot's logs by `paths`, `topics` or `joints`",
    "log.csv.also": "name the further files beside the log on the command line",
    "log.csv.labels": "state the columns in [log] `labels`",
    "log.csv.phase": "state the column in [log] `phase`",
    "log.csv.skip_rows": "state the number of the line that holds the names, one more, as [log.csv] `header`",
    "log.fields.wrench_stamp": "take the line out: [log.fields] `stamp` is read on both topics",
    "log.label_topics": "state the topics in [log] `labels`",
    "log.phase_topic": "state the topic in [log] `phase`",
    "plan.link_radius_m": "give the link a shape in the description (URDF collision), which is then used",
    "policy.accepted": "put accepted.toml beside the configuration, and take the line out",
    "policy.findings": "take the line out: what a finding does to the verdict, docs/findings.md says",
    "policy.max_fit_age_days": "take the line out; friction.json says when its logs were recorded",
    "policy.observable_ms": "take the line out: the push that must alarm lasts 0.2 s",
    "robot.gravity_m_s2": "say how the arm is mounted by [robot] `base_rpy_deg`",
}
