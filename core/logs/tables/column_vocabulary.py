"""The words that robot software writes above its columns: quantity, role and unit of each, as data.

Sources are the public documentation of libfranka (RobotState), UR (RTDE, RobotStateRTMsg), KUKA (FRI, RSI), ABB (EGM),
Doosan (robot state), Kinova (Kortex), ROS (``rostopic echo -p``) and PlotJuggler (CSV export).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from collaudit.core.logs.signals.numbered_names import MARK

Role = Literal[
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
USABLE: tuple[Role, ...] = ("measured", "plain", "filtered", "side")
#: A column with words of several roles has the first of these.
_STRONGEST: tuple[Role, ...] = (
    "derivative", "error", "external", "model", "desired", "commanded", "side", "filtered", "measured"
)  # fmt: skip

#: Words of each quantity, the usual first.
QUANTITY_WORDS: dict[str, tuple[str, ...]] = {
    "position": ("q", "position", "positions", "pos", "angle", "angles", "jpos", "theta"),
    "velocity": ("dq", "qd", "qdot", "velocity", "velocities", "vel", "speed", "speeds", "jvel", "omega", "dtheta"),
    "effort": ("tau", "torque", "torques", "effort", "efforts", "eff", "trq", "moment", "moments", "tor",
               "current", "currents", "curr", "i"),
    "temperature": ("temperature", "temperatures", "temp", "temps"),
}  # fmt: skip
#: Words of ``effort`` that say the numbers are currents.
CURRENTS = frozenset({"current", "currents", "curr", "i"})
#: Words of the motor's side: of any quantity, and of quantities that have another word on the joint's side.
_MOTOR = frozenset({"motor", "motors", "rotor", "rotors"})
_MOTOR_WORDS = frozenset({"theta", "dtheta"})
#: Positions that a ``dot`` behind makes velocities, and the velocity's word.
_BY_DOT = {"q": "qdot", "theta": "dtheta"}

ROLE_WORDS: dict[Role, tuple[str, ...]] = {
    "measured": ("actual", "act", "measured", "meas", "measure", "msr", "feedback", "fbk", "present", "real"),
    "filtered": ("filtered", "filt", "filter", "lp", "lpf", "smooth", "smoothed"),
    "side": ("sensor", "sensors", "motor", "motors", "rotor", "rotors"),
    "desired": ("d", "des", "desired", "target", "tgt", "ref", "reference", "goal", "set", "setpoint", "sp", "planned",
                "nominal", "ipo"),
    "commanded": ("c", "cmd", "command", "commanded", "commands", "u", "control"),
    "model": ("model", "sim", "simulated", "rnea", "id", "gravity", "grav", "coriolis", "ff", "feedforward", "pred",
              "predicted", "dynamic", "est", "estimated", "hat", "nominal_model", "friction"),
    "external": ("ext", "external", "contact", "disturbance", "dist", "residual", "res"),
    "error": ("e", "err", "error", "diff", "deviation", "delta"),
    "derivative": ("ddot", "acceleration", "accelerations", "acc", "accel", "jerk", "dot"),
}  # fmt: skip
ROLE_OF: dict[str, Role] = {word: role for role, words in ROLE_WORDS.items() for word in words}
#: Words that say nothing but "of a joint".
JOINT_WORDS = frozenset({"joint", "joints", "j", "axis", "axes", "jnt", "actuator", "actuators"})
#: Words that carry nothing in front of a quantity.
_FILLERS = frozenset({"raw", "robot", "state", "states", "field", "data", "link", "load"})
#: Words of other things than joints: no joint signal has them.
_ELSEWHERE = frozenset({"tcp", "tool", "ee", "eef", "cartesian", "cart", "force", "wrench", "pose", "base", "imu"})
#: Units inside names.
UNIT_WORDS = {"deg": "deg", "degree": "deg", "degrees": "deg", "rad": "rad", "radian": "rad", "radians": "rad",
              "degps": "deg/s", "degs": "deg/s", "dps": "deg/s", "radps": "rad/s", "rads": "rad/s",
              "nm": "Nm", "a": "A", "amp": "A", "amps": "A", "ma": "mA", "mrad": "mrad", "rpm": "rpm", "mnm": "mNm",
              "turns": "turns", "counts": "counts", "ticks": "ticks", "percent": "percent"}  # fmt: skip
_UNITS_OF = {
    "position": ("deg", "rad", "mrad", "turns", "counts", "ticks"),
    "velocity": ("deg/s", "rad/s", "rpm", "deg", "rad"),
    "effort": ("Nm", "mNm", "A", "mA", "counts", "percent"),
    "temperature": ("deg",),
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
    role: Role
    word: str
    unit: str = ""
    motor: bool = False


#: Names that only their source explains, letters only and in lower case: (quantity, role, word, unit).
_KNOWN: dict[str, Meaning] = {
    "aipos": Meaning("position", "measured", "aipos", "deg"),  # KUKA RSI: axis-specific actual position
    "aspos": Meaning("position", "desired", "aspos", "deg"),  # KUKA RSI: setpoint
    "macur": Meaning("effort", "measured", "macur", "current"),  # KUKA RSI: motor currents
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

#: Columns that may mark true events, letters only and in lower case.
LABEL_WORDS = ("label", "labels", "anomaly", "anomalies", "collision", "collisions", "iscollision", "contact",
               "contacts", "incontact", "touch", "robotprotectivestop", "protectivestop", "collisionlabel")  # fmt: skip
#: Units that are converted; columns in others are passed over.
CONVERTED = ("", "deg", "rad", "deg/s", "rad/s", "Nm", "A", "current")
#: A joint that is itself called by a letter and a number is named, not numbered.
_NAMED_AXIS = re.compile("joint_?a\0", re.IGNORECASE)
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])(?!(?<=\bm)A\b|(?<=_m)A(?![A-Za-z])|(?<=_m)Nm)")


def is_label(name: str) -> bool:
    """Whether a column is named as a mark of true events."""
    return re.sub(r"[^a-z]", "", name.lower()) in LABEL_WORDS and not re.search(r"\d", name)


def words_of(text: str) -> list[str]:
    """Words of a name in lower case; the number's mark stays with the word it touches.

    An ``x`` in front of a path is no word: MATLAB puts it before names that begin with no letter.
    """
    words = [word for word in re.split(rf"[^A-Za-z0-9{MARK}]+", _CAMEL.sub("_", text).lower()) if word]
    return words[1:] if words[:2] == ["x", "joint"] else words


@lru_cache(maxsize=4096)
def meaning_of(stem: str) -> Meaning | None:
    """What the columns of a stem are; None where a word is unknown.

    Args:
        stem: a name whose joint number is replaced by :data:`MARK`.
    """
    if _NAMED_AXIS.search(stem):
        return None
    segments = [part for part in re.split(r"[/.]", stem) if part.strip(MARK + "[]()_ ")]
    words = [word for part in segments for word in words_of(part)]
    plain = [word.replace(MARK, "") for word in words]
    letters = "".join(word for word, whole in zip(plain, words, strict=True) if not _axis(word, whole))
    for known, meaning in _KNOWN.items():
        if letters.removeprefix("field").removeprefix("state") == known:
            return meaning
    last = set(words_of(segments[-1])) if segments else set()
    if last and all(word.replace(MARK, "") in JOINT_WORDS or word == "a" + MARK for word in last):
        last = set(words_of(segments[-2])) if len(segments) > 1 else last
    return _by_words(words, last, kinova="actuators" in plain)


def _axis(word: str, whole: str) -> bool:
    return not word or (MARK in whole and word in ("a", "j", "joint", "axis"))


def _by_words(words: list[str], last: set[str], *, kinova: bool) -> Meaning | None:
    found: tuple[str, str] | None = None
    roles: set[Role] = set()
    units: list[str] = []
    for whole in words:
        word = whole.replace(MARK, "")
        attached = MARK in whole
        quantity = next((q for q, known in QUANTITY_WORDS.items() if word in known), None)
        if word in _ELSEWHERE:
            return None
        if not word or word in JOINT_WORDS or (word == "a" and (attached or not _is_current(found))):
            continue
        if found and word == "dot" and found[1] in _BY_DOT:
            found = ("velocity", _BY_DOT[found[1]])
        elif found and word in ("s", "sec", "per") and (not units or units[-1][:3] in ("deg", "rad")):
            units = [unit.removesuffix("/s") + "/s" for unit in units]
        elif quantity is not None and (found is None or whole in last or attached):
            if found is not None and found[0] != quantity and whole in last and found[1] in last:
                return None
            found = (quantity, word)
        elif word in UNIT_WORDS and found:
            units.append(UNIT_WORDS[word])
        elif word in ROLE_OF:
            if len(word) > 1 or whole in last:
                roles.add(ROLE_OF[word])
        elif whole in last and word not in _FILLERS:
            return None
    motor = not _MOTOR.isdisjoint(word.replace(MARK, "") for word in words)
    return _meaning(found, roles, units, kinova=kinova, motor=motor) if found else None


def _is_current(found: tuple[str, str] | None) -> bool:
    return found is not None and found[1] in CURRENTS


def _meaning(
    found: tuple[str, str], roles: set[Role], units: list[str], *, kinova: bool, motor: bool
) -> Meaning | None:
    quantity, word = found
    if quantity == "temperature" or word in CURRENTS:
        roles.discard("side")  # the motor is where these are measured
    if word in _MOTOR_WORDS:
        roles.add("side")
    role: Role = next((role for role in _STRONGEST if role in roles), "plain")
    unit = units[-1] if units else ""
    if unit and unit not in _UNITS_OF[quantity]:
        return None
    if quantity == "velocity" and unit in ("deg", "rad"):
        unit += "/s"
    if not unit and kinova:  # Kortex states degrees
        unit = {"position": "deg", "velocity": "deg/s"}.get(quantity, "")
    if not unit and word in CURRENTS:
        unit = "current"
    return Meaning(quantity, role, word, unit, motor)
