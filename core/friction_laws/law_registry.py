"""The one table of friction laws, and their names as a type that is checked against it.

A new law is an instance of ``SeparableLaw`` or ``RidgeLaw`` in a file of this room and a line in ``LAWS``. Everything
else follows: the configuration takes its name, ``model = "auto"`` compares it, friction.json and reports name its
parameters. No other room compares or lists names of laws.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from collaudit.core.errors import CollauditError
from collaudit.core.friction_laws.friction_law import FrictionLaw
from collaudit.core.friction_laws.gaussian_bumps import RBF
from collaudit.core.friction_laws.levelling import SATURATING_VISCOUS, SMOOTH_COULOMB_VISCOUS
from collaudit.core.friction_laws.straight_lines import COULOMB_VISCOUS
from collaudit.core.friction_laws.stribeck import STATIC_LUGRE, STRIBECK_GAUSS

#: Simplest first: of laws that explain the points as well with as many parameters, the earlier is taken.
LAWS: dict[str, FrictionLaw] = {
    law.name: law
    for law in (
        COULOMB_VISCOUS,
        SMOOTH_COULOMB_VISCOUS,
        STATIC_LUGRE,
        STRIBECK_GAUSS,
        SATURATING_VISCOUS,
        RBF,
    )
}


def law_named(name: str) -> FrictionLaw:
    """The law of a name.

    Raises:
        CollauditError: there is none.
    """
    if name not in LAWS:
        raise CollauditError("there is no friction law of this name", found=name, expected=" or ".join(LAWS))
    return LAWS[name]


#: The straight line that every law is compared with, and that is fallen back to.
LINE = COULOMB_VISCOUS
#: The law whose undetermined parameters explain why the line was taken; an F test takes it where no speed can be held
#: out.
REFERENCE = STATIC_LUGRE


@dataclass(frozen=True, slots=True)
class NameOfLaw:
    """Which texts a key or field accepts: looked up in the table when asked, so that a law added later is known.

    Whoever holds such a text checks it when it is made; the published schemas list the choices.

    Attributes:
        extra: other texts that are allowed.
    """

    extra: tuple[str, ...] = ()

    @property
    def choices(self) -> tuple[str, ...]:
        """All texts that are allowed."""
        return (*self.extra, *LAWS)


#: The name of a law.
LawName = Annotated[str, NameOfLaw()]
#: What the configuration may ask for.
LawChoice = Annotated[str, NameOfLaw(("auto",))]
