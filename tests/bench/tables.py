"""Tables of measurements: those that a documentation page has marks for go there, all others below ``build/tables``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

#: Tables that no page shows.
EVIDENCE = Path(__file__).resolve().parents[2] / "build" / "tables"


def put(page: Path, name: str, lines: Sequence[str]) -> None:
    """Replace what stands between ``<!-- name -->`` and ``<!-- /name -->``, or write ``build/tables/PAGE-NAME.md``."""
    head, tail = f"<!-- {name} -->\n", f"<!-- /{name} -->"
    text = page.read_text(encoding="utf-8")
    if head not in text:
        EVIDENCE.mkdir(parents=True, exist_ok=True)
        (EVIDENCE / f"{page.stem}-{name}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
        return
    before, rest = text.split(head)
    after = rest[rest.index(tail) :]
    page.write_text(before + head + "\n".join(lines) + "\n" + after, encoding="utf-8")
