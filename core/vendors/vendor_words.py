"""The words of robot software: above columns (quantity, role, unit), of joints, and for a controller's modes."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Literal

#: Arms whose drivers publish joint-side torque sensors, by the names of their joints.
TORQUE_SENSED = re.compile(
    r"(^|[_/])(panda|fer|fr3|fp3|franka|iiwa\d*|lbr(_\w+)?|lwr|med7|med14|gen3|rizon\d*|diana\d*|sawyer)(_|$)", re.I
)
#: Joints of grippers, by the words that their descriptions use.
GRIPPER = re.compile(r"finger|gripper|knuckle|(^|[_/])jaw", re.I)
SignalRole = Literal[
    "measured",
    "plain",
    "filtered",
    "side",
    "desired",
    "commanded",
    "model",
    "external",
    "error",
    "derivative",
    "unknown word",
]
#: Roles that a guess may take for a measurement, best first.
USABLE: tuple[SignalRole, ...] = ("measured", "plain", "filtered", "side")
#: A column with words of several roles has the first of these.
STRONGEST: tuple[SignalRole, ...] = (
    "derivative", "error", "external", "model", "desired", "commanded", "side", "filtered", "measured"
)  # fmt: skip
#: Words of each quantity in the names of columns, and of files that hold one quantity, the usual first.
QUANTITY_WORDS: dict[str, tuple[str, ...]] = {
    "position": ("q", "qpos", "position", "positions", "pos", "angle", "angles", "ang", "jpos", "theta"),
    "velocity": ("dq", "qd", "qdot", "qvel", "velocity", "velocities", "vel", "speed", "speeds", "jvel", "omega",
                 "dtheta"),
    "effort": ("tau", "torque", "torques", "effort", "efforts", "eff", "trq", "moment", "moments", "tor",
               "current", "currents", "curr", "cur", "i"),
    "temperature": ("temperature", "temperatures", "temp", "temps"),
}  # fmt: skip
#: Words of ``effort`` that say the numbers are currents.
CURRENTS = frozenset({"current", "currents", "curr", "cur", "i"})
#: Words of the motor's side: of any quantity, and of quantities that have another word on the joint's side.
MOTOR = frozenset({"motor", "motors", "rotor", "rotors"})
MOTOR_WORDS = frozenset({"theta", "dtheta"})
#: Positions that a ``dot`` behind makes velocities, and the velocity's word.
BY_DOT = {"q": "qdot", "theta": "dtheta"}
ROLE_WORDS: dict[SignalRole, tuple[str, ...]] = {
    "measured": ("actual", "act", "measured", "meas", "measure", "msr", "feedback", "fbk", "present", "real"),
    "filtered": ("filtered", "filt", "filter", "lp", "lpf", "smooth", "smoothed"),
    "side": ("sensor", "sensors", "motor", "motors", "rotor", "rotors"),
    "desired": ("d", "des", "desired", "target", "targets", "tgt", "ref", "refs", "reference", "references", "goal",
                "goals", "set", "setpoint", "setpoints", "sp", "planned", "nominal", "ipo", "demand", "demanded",
                "requested", "programmed"),
    "commanded": ("c", "cmd", "cmds", "command", "commanded", "commands", "u", "control", "action", "actions"),
    "model": ("model", "sim", "simulated", "rnea", "id", "gravity", "grav", "coriolis", "ff", "feedforward", "pred",
              "predicted", "computed", "calculated", "dynamic", "est", "estimated", "hat", "nominal_model", "friction"),
    "external": ("ext", "external", "contact", "disturbance", "dist", "residual", "res"),
    "error": ("e", "err", "error", "diff", "deviation", "delta"),
    "derivative": ("ddot", "acceleration", "accelerations", "acc", "accel", "jerk", "dot"),
}  # fmt: skip
ROLE_OF: dict[str, SignalRole] = {word: role for role, words in ROLE_WORDS.items() for word in words}
#: Words of columns that say nothing of a topic: DynamicJointState is published as ``dynamic_joint_states``, feedback of
#: an action below ``_action``.
NO_TOPIC = frozenset({"dynamic", "action", "actions"})
#: Words of desired and commanded signals that name robots and nodes as well: above a topic they say nothing.
NO_NAMESPACE = frozenset({"d", "c", "u", "ref", "set", "sp", "nominal", "control"})
#: Words that say nothing but "of a joint".
JOINT_WORDS = frozenset({"joint", "joints", "j", "axis", "axes", "jnt", "actuator", "actuators"})
#: Words that carry nothing in front of a quantity.
FILLERS = frozenset({"raw", "robot", "robot0", "robot1", "state", "states", "field", "data", "link", "load"})
#: Words of other things than joints: no joint signal has them.
ELSEWHERE = frozenset({"tcp", "tool", "ee", "eef", "cartesian", "cart", "force", "wrench", "pose", "base", "imu"})
#: Units inside names.
UNIT_WORDS = {"deg": "deg", "degree": "deg", "degrees": "deg", "rad": "rad", "radian": "rad", "radians": "rad",
              "degps": "deg/s", "degs": "deg/s", "dps": "deg/s", "radps": "rad/s", "rads": "rad/s",
              "nm": "Nm", "a": "A", "amp": "A", "amps": "A", "ma": "mA", "mrad": "mrad", "rpm": "rpm", "mnm": "mNm",
              "turns": "turns", "counts": "counts", "ticks": "ticks", "percent": "percent",
              "pct": "percent", "permille": "permille"}  # fmt: skip
UNITS_OF = {
    "position": ("deg", "rad", "mrad", "turns", "counts", "ticks"),
    "velocity": ("deg/s", "rad/s", "rpm", "deg", "rad"),
    "effort": ("Nm", "mNm", "A", "mA", "counts", "percent", "permille"),
    "temperature": ("deg",),
}
#: Columns that may mark true events, letters only and in lower case.
LABEL_WORDS = ("label", "labels", "anomaly", "anomalies", "collision", "collisions", "iscollision", "contact",
               "contacts", "incontact", "touch", "robotprotectivestop", "protectivestop", "collisionlabel")  # fmt: skip
#: Doosan's real-time state (dsr_msgs2/RobotStateRt): names that only it has beside ``actual_joint_position``, and what
#: other names mean beside them. It is in degrees, and ``actual_joint_torque`` is estimated.
DOOSAN_ONLY = frozenset({"rawjointtorque", "externaljointtorque", "actualmotortorque", "actualjointpositionabs"})
DOOSAN: dict[str, dict[str, Any]] = {
    "actualjointposition": {"unit": "deg"},
    "actualjointvelocity": {"unit": "deg/s"},
    "actualjointtorque": {"role": "model"},
}
#: Words of a path below which angles are in degrees: Kinova's Kortex.
DEGREES_BELOW = frozenset({"actuators"})
#: Units of efforts that are converted by constants of the drives.
OF_DRIVES = ("A", "mA", "current", "percent", "permille")
#: Units that are converted; columns in others are passed over.
CONVERTED = ("", "deg", "rad", "deg/s", "rad/s", "Nm", *OF_DRIVES)
StateKind = Literal["stopped", "guided", "off"]
#: Values of UR's safety_mode and robot_mode (RTDE, ur_dashboard_msgs), and of libfranka's robot_mode, by the state that
#: each stands for; other values are ordinary.
UR_SAFETY_MODE = {3: "protective_stop", 5: "safeguard_stop", 6: "emergency_stop", 7: "emergency_stop",
                  8: "safety_stop", 9: "safety_stop"}  # fmt: skip
UR_ROBOT_MODE = {3: "power_off", 4: "power_off", 5: "power_off", 6: "backdrive"}
FRANKA_MODE = {3: "guiding", 4: "reflex", 5: "user_stop"}
#: A robot_mode that is ever this is UR's: running.
UR_RUNNING = 7
#: The same in words, letters only and in lower case, libfranka's with and without their k.
MODE_WORDS = {"protectivestop": "protective_stop", "safeguardstop": "safeguard_stop", "emergencystop": "emergency_stop",
              "robotemergencystop": "emergency_stop", "systememergencystop": "emergency_stop", "poweroff": "power_off",
              "backdrive": "backdrive", "freedrive": "freedrive", "guiding": "guiding", "handguiding": "guiding",
              "reflex": "reflex", "userstopped": "user_stop"}  # fmt: skip
#: Ends of the names of columns that hold UR's safety mode, and a robot_mode, letters only and in lower case.
SAFETY_COLUMNS, ROBOT_COLUMNS = ("safetymode", "safetystatus"), ("robotmode",)
#: Names of flags, letters only and in lower case.
_FLAGS: dict[StateKind, frozenset[str]] = {
    "stopped": frozenset(
        {"protectivestop", "robotprotectivestop", "safeguardstop", "emergencystop", "userstop", "userstopped", "reflex",
         "jointreflex", "cartesianreflex", "safetystop", "stopcategory0", "stopcategory1", "estop"}
    ),
    "guided": frozenset({"guiding", "handguiding", "freedrive", "backdrive", "leadthrough", "zerog"}),
    "off": frozenset({"poweroff", "drivesoff", "brakeson", "motorsoff"}),
}  # fmt: skip
STATE_WORDS: dict[StateKind, str] = {
    "stopped": "stopped by its controller",
    "guided": "guided by hand",
    "off": "without power at its drives",
}


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a column's words say.

    Attributes:
        quantity: position, velocity, effort or temperature.
        role: what kind of value of it.
        word: the quantity's word.
        unit: the unit that the name or its source's documentation states; "" for none.
        motor: whether the name says that it is the motor's side of the gear.
    """

    quantity: str
    role: SignalRole
    word: str
    unit: str = ""
    motor: bool = False


#: Names that only their source explains, letters only and in lower case: (quantity, role, word, unit).
KNOWN: dict[str, Meaning] = {
    "aipos": Meaning("position", "measured", "aipos", "deg"),  # KUKA RSI: axis-specific actual position
    "axisact": Meaning("position", "measured", "axis", "deg"),  # KUKA KSS: $AXIS_ACT, the variable and its trace
    "axisactmeas": Meaning("position", "measured", "axis", "deg"),
    "aspos": Meaning("position", "desired", "aspos", "deg"),  # KUKA RSI: setpoint
    "macur": Meaning("effort", "measured", "macur", "current"),  # KUKA RSI: motor currents
    "istposition": Meaning("position", "measured", "istposition"),  # KUKA traces in German
    "sollposition": Meaning("position", "desired", "sollposition"),
    "istgeschwindigkeit": Meaning("velocity", "measured", "istgeschwindigkeit"),
    "sollgeschwindigkeit": Meaning("velocity", "desired", "sollgeschwindigkeit"),
    "istmoment": Meaning("effort", "measured", "istmoment"),
    "sollmoment": Meaning("effort", "desired", "sollmoment"),
    "targetmoment": Meaning("effort", "model", "moment", "Nm"),  # UR RTDE: from the model, not measured
    "jointcontroloutput": Meaning("effort", "commanded", "output", "current"),  # UR RTDE
    "feedbackjoints": Meaning("position", "measured", "joints", "deg"),  # ABB EGM
    "feedbackjointsjoints": Meaning("position", "measured", "joints", "deg"),
    "plannedjoints": Meaning("position", "desired", "joints", "deg"),
    "plannedjointsjoints": Meaning("position", "desired", "joints", "deg"),
    "jointvelocityestimated": Meaning("velocity", "filtered", "velocity", "rad/s"),  # lcmt_iiwa_status
    "estimatedjointvelocities": Meaning("velocity", "filtered", "velocity", "rad/s"),
    "actualjointposition": Meaning("position", "measured", "position", ""),
    "actualjointpositionabs": Meaning("position", "side", "position", "deg"),  # Doosan: encoder of the link
    "actualjointvelocityabs": Meaning("velocity", "side", "velocity", "deg/s"),
    "rawjointtorque": Meaning("effort", "measured", "torque", ""),  # Doosan: joint torque sensor
    "dynamictor": Meaning("effort", "model", "tor", "Nm"),  # Doosan
    "commandedtorque": Meaning("effort", "commanded", "torque", ""),
    "observationstate": Meaning("position", "measured", "state", ""),  # LeRobot
    "positionsraw": Meaning("position", "measured", "positions", "rad"),  # FloBaRoID: as recorded, beside filtered ones
    "velocitiesraw": Meaning("velocity", "measured", "velocities", "rad/s"),
    "torquesraw": Meaning("effort", "measured", "torques", "Nm"),
}


def state_of(flag: str) -> StateKind | None:
    """The state that a flag of this name stands for; None for any other flag."""
    letters = re.sub(r"[^a-z0-9]", "", flag.lower())
    return next((kind for kind, names in _FLAGS.items() if letters in names), None)
