"""Known loads of the logs of a fit, as flags state them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from collaudit.core.errors import ConfigError

if TYPE_CHECKING:
    from collaudit.core.prepare.known_load import KnownLoad

_NUMBERS = (1, 4)


def known_loads(texts: Sequence[str], inputs: int) -> list[KnownLoad]:
    """Loads of the inputs; empty where none is given.

    Raises:
        ConfigError: not one for each input, or no mass and place.
    """
    from collaudit.core.prepare.known_load import KnownLoad

    if texts and len(texts) != inputs:
        raise ConfigError(
            "known loads are given for some of the logs only",
            where="--load",
            found=f"{len(texts)} for {inputs} logs",
            expected="one for each, in their order; 0 for none",
        )
    out = []
    for text in texts:
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) not in _NUMBERS or not 0.0 <= numbers[0] < 1e4 or not all(abs(x) < 1e3 for x in numbers[1:]):
            raise ConfigError("this is no load", where="--load", found=text, expected="KG or KG,X,Y,Z (m)")
        place = (numbers[1], numbers[2], numbers[3]) if len(numbers) > 1 else (0.0, 0.0, 0.0)
        out.append(KnownLoad(numbers[0], place))
    return out
