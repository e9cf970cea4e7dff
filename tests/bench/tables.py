"""Tables of measurements between marks of a documentation page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def put(page: Path, name: str, lines: Sequence[str]) -> None:
    """Replace what stands between ``<!-- name -->`` and ``<!-- /name -->``."""
    head, tail = f"<!-- {name} -->\n", f"<!-- /{name} -->"
    before, rest = page.read_text(encoding="utf-8").split(head)
    after = rest[rest.index(tail) :]
    page.write_text(before + head + "\n".join(lines) + "\n" + after, encoding="utf-8")
