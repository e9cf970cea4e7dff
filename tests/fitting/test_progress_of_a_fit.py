"""How far a fit is: told in small steps that only rise."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

from collaudit.core.api import fit
from collaudit.core.config import load_config


def test_a_fit_tells_in_small_steps_how_far_it_is(hits: Path) -> None:
    shares: list[float] = [0.0]
    settings = load_config(hits.with_suffix(".toml"), {"fit.motion": "any"})
    fit([hits], settings, lambda done, total: shares.append(done / total))
    assert all(before <= after for before, after in pairwise(shares))
    assert max(after - before for before, after in pairwise(shares)) < 0.15
    assert len(set(shares)) > 40 and shares[-1] == 1.0
