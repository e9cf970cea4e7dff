"""What a fit identifies of logs, before friction: the way is chosen, the motion gathered, and the rest is solved."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import Identified
from collaudit.core.identification import identification
from collaudit.core.identification.estimate_choice import choose
from collaudit.core.identification.motion_sums import collect
from collaudit.core.identification.solved_problem import Candidate
from collaudit.core.prepare.prepared import Prepared


def identify(prepared: Sequence[Prepared], config: Config, taken: Candidate | None = None) -> Identified | None:
    """What ``taken``, or what is chosen, says of the logs beyond friction; None where that is nothing."""
    taken = choose(prepared, config)[0] if taken is None else taken
    if not taken.estimate:
        return None
    return identification.identify(prepared, config, taken, collect(prepared, config.fit.blocks))
