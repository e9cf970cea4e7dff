"""Who sets the keys of a table of the configuration."""

from __future__ import annotations

WHO_SETS = {
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
    "cycles": "whoever knows where the cycles of a program begin, or wants none compared.",
    "near_miss": "whoever counts near misses differently from the defaults.",
    "phases": "whoever recorded a task in which the tool was meant to touch something.",
    "policy": "whoever decides what fails a night, and what must have been noticed for a pass.",
    "report": "whoever signs the report.",
    "plan": "whoever is responsible for the cell, before a planned motion is run in it.",
    "fleet": "whoever audits logs of several robots in one run.",
    "fleet.robots": "whoever audits them, for each robot.",
}
