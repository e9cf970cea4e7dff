"""Names and units of friction parameters: N·m for torques, N for prismatic joints, raw for unknown efforts."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.data.joint_log import EffortUnit, JointType
from collaudit.core.friction_laws.friction_law import FrictionLaw


@dataclass(frozen=True, slots=True)
class FrictionUnits:
    """Units of one joint's friction.

    Attributes:
        effort: unit of friction: ``N·m``, ``N`` or ``raw``.
        speed: ``rad/s`` or ``m/s``.
        suffix: the effort's suffix in file keys.
        length: ``rad`` or ``m``.
    """

    effort: str
    speed: str
    suffix: str
    length: str

    @classmethod
    def of(cls, joint_type: JointType, effort_unit: EffortUnit) -> FrictionUnits:
        """Units for a kind of joint and a log's effort unit."""
        length = "m" if joint_type == "prismatic" else "rad"
        if effort_unit == "raw":
            return cls("raw", f"{length}/s", "raw", length)
        effort, suffix = ("N", "n") if joint_type == "prismatic" else ("N·m", "nm")
        return cls(effort, f"{length}/s", suffix, length)

    @property
    def viscous(self) -> str:
        """Unit of D."""
        return f"{self.effort}·s/{self.length}"

    def key(self, law: FrictionLaw, symbol: str) -> str:
        """Key of a law's parameter in friction.json: its symbol and its unit."""
        unit = {
            "friction": f"_{self.suffix}",
            "viscous": f"_{self.suffix}_s_per_{self.length}",
            "rate": f"_s_per_{self.length}",
            "speed": f"_{self.length}_per_s",
            "number": "",
        }
        return symbol + unit[law.parameter(symbol).kind]


def parameter_symbol(key: str) -> str:
    """The symbol in a key: ``A_nm`` → ``A``."""
    return key.partition("_")[0]
