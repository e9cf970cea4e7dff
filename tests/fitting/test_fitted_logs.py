"""What a friction file says of the logs that it is from."""

from __future__ import annotations

from types import SimpleNamespace

from collaudit.core.fitting import _hashes


def test_two_fitted_logs_of_one_name_are_both_kept() -> None:
    def log(sha256: str) -> SimpleNamespace:
        return SimpleNamespace(series=SimpleNamespace(source=SimpleNamespace(name="run.mcap", sha256=sha256)))

    assert _hashes([log("a"), log("b"), log("c")]) == {"run.mcap": "a", "run.mcap (2)": "b", "run.mcap (3)": "c"}  # type: ignore[list-item]
