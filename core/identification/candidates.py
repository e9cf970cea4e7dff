"""Ways to fit: what is identified beside friction, and how far the description is trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from collaudit.core.config.schema import Config

#: Trust in the description that is tried where none is stated: standard deviation of its inertials, as a share.
WIDTHS = (0.2, 1.0, 5.0)


@dataclass(frozen=True, slots=True)
class Candidate:
    """One way to fit.

    Attributes:
        estimate: what is identified beside friction; empty for friction on the description as it is.
        width: standard deviation of the described inertials, as a share of them.
        springs: joints of which a torque by their angle is identified, by number; None for all, where ``spring`` is.
    """

    estimate: tuple[str, ...]
    width: float
    springs: tuple[int, ...] | None = None

    @property
    def words(self) -> str:
        """What it identifies."""
        if "inertials" not in self.estimate:
            return ", ".join(("friction", *self.estimate))
        return f"{', '.join(('friction', *self.estimate))} (description ± {100 * self.width:g} %)"


def candidates_of(
    estimate: Sequence[str] | str, config: Config, with_gain: bool, with_rotor: bool = True
) -> tuple[Candidate, ...]:
    """What is tried, the simplest first.

    Args:
        estimate: as configured: ``auto``, or what is to be identified in any case.
        config: states how far the description is trusted, or leaves that to the data.
        with_gain: whether the scale of the effort is open to the data.
        with_rotor: whether the effort has the torque that accelerates the rotors; behind the gears it has not.
    """
    widths = WIDTHS if config.fit.cad_sd is None else (config.fit.cad_sd,)
    if estimate != "auto":
        stated = tuple(item for item in estimate if item != "friction")
        return tuple(Candidate(stated, w) for w in (widths if "inertials" in stated else widths[:1]))
    parts = ((), ("rotor",), ("rotor", "tool")) if with_rotor else ((), ("tool",))
    plain = [Candidate(part, widths[0]) for part in parts]
    every = [*plain, *(Candidate(("inertials",), w) for w in widths)]
    return tuple([*every, *(replace(c, estimate=(*c.estimate, "gain")) for c in every)] if with_gain else every)


def with_springs(tried: Sequence[Candidate], joints: tuple[int, ...]) -> tuple[Candidate, ...]:
    """Each candidate also with torques by the angles of some joints; these after all that are rigid bodies alone.

    Args:
        tried: the simplest first; those with gains, which such torques would be mistaken for, get none.
        joints: by number.
    """

    def rank(one: Candidate) -> tuple[bool, bool, bool]:
        return "gain" in one.estimate, "spring" in one.estimate, "inertials" in one.estimate

    more = [replace(c, estimate=(*c.estimate, "spring"), springs=joints) for c in tried if "gain" not in c.estimate]
    return tuple(sorted((*tried, *more), key=rank))


def wanted(config: Config) -> tuple[str, ...] | Literal["auto"]:
    """What is to be identified; a tool whose mass is ``estimate`` belongs to it."""
    if config.fit.estimate == "auto":
        return "auto"
    asked = list(dict.fromkeys(config.fit.estimate))
    if config.robot.tool.mass_kg == "estimate" and "tool" not in asked:
        asked.append("tool")
    return tuple(asked)
