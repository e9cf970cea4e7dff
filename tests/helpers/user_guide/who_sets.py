"""Who sets a key of the configuration, and when: by table, and by key where the answer is another one."""

from __future__ import annotations

#: Of a table: who sets its keys.
TABLES = {
    "robot": "whoever has the data sheet or the description of the arm.",
    "robot.dh": "whoever has a table of Denavit-Hartenberg rows and no URDF.",
    "robot.tool": "whoever mounted the tool.",
    "log": "whoever knows the recorder and the controller; `init` proposes what it can tell.",
    "log.fields": "whoever logs messages of own types, which no profile reads.",
    "log.csv": "whoever logs tables; `init` writes the columns that it recognises.",
    "log.units": "whoever knows in which units the controller logs.",
    "conditioning": "whoever compares velocities and filters; the default holds for the arms of docs/evidence.md.",
    "sections": "whoever fits an axis that is much slower or less steady than an arm's, or one in m/s.",
    "friction": "whoever fits friction, or judges with it.",
    "fit": "whoever identifies an arm.",
    "detect": "whoever signs the rule.",
    "near_miss": "whoever counts near misses differently from the defaults.",
    "phases": "whoever recorded a task in which the tool was meant to touch something.",
    "policy": "whoever decides what fails a night, and what must have been noticed for a pass.",
    "report": "whoever signs the report.",
    "plan": "whoever is responsible for the cell, before a planned motion is run in it.",
    "fleet": "whoever audits logs of several robots in one run.",
    "fleet.robots": "whoever audits them, for each robot.",
}

#: Of a key: who sets it, where the table's sentence does not say it.
KEYS = {
    "robot.joints": "whoever audits a part of the arm, or a log with joints of several.",
    "robot.parked": "whoever audits an arm on a rail or a turntable that stood still.",
    "robot.base_rpy_deg": "whoever mounted the arm on a wall, a ceiling or a slope.",
    "robot.gravity_m_s2": "whoever wants the local gravity, or audits an arm in a tilted vehicle.",
    "robot.reduction": "whoever logs encoders and torques before the gears.",
    "robot.joint_offset_rad": "whoever calibrated the zeros and did not write them into the description.",
    "robot.motor_side": "whoever logs some signals before the gears and some behind.",
    "log.effort_delay_ms": "whoever measured the delay; a finding names it where the log shows one.",
    "log.wrench_delay_ms": "whoever measured the delay of the sensor.",
    "log.time": "whoever knows that one of the two clocks is wrong.",
    "log.label_topics": "whoever marked true events or logs the controller's own alarms.",
    "log.phase_topic": "whoever logs the step of the task.",
    "log.memory_gb": "whoever reads a large log that was refused.",
    "log.msg_path": "whoever logs ROS types without their definitions.",
    "conditioning.bandwidth_hz": "whoever wants knocks to show sooner, or noise to show less.",
    "fit.max_samples": "whoever has more memory and time for a fit of arbitrary motion.",
    "fit.blocks": "whoever tests how far a fit depends on what is held out.",
    "detect.detector": "whoever compares detectors, or knows the one of the controller.",
    "detect.causal": "whoever wants to know what the controller could have seen at that time.",
    "detect.observer_gain_per_s": "whoever tunes the observer.",
    "detect.friction_level": "whoever warms the arm up before each log.",
    "detect.hand_guiding": "whoever knows that nobody guides this arm by hand.",
    "detect.true_events": "whoever scores the detection against labelled contacts.",
    "phases.find": "whoever has a wrist sensor and no log of the task's steps.",
    "policy.findings": "whoever wants to fail by a finding.",
    "policy.known": "the owner of the night, who then answers for every contact that earlier nights had.",
    "policy.max_fit_age_days": "whoever knows how fast the gears wear.",
}


def who_sets(dotted: str) -> str:
    """Who sets one key, or the keys of a table; empty where the table's sentence holds."""
    return KEYS.get(dotted, TABLES.get(dotted, ""))
