"""A drafted configuration as JSON: what ``init --json`` prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from collaudit.cli.drafts.trial import Trial
from collaudit.reports.files.json_writer import json_text

INIT_SCHEMA = "collaudit/init/1"


def draft_json(text: str, output: Path | None, trial: Trial, missing: Sequence[str]) -> str:
    """The draft, what trying it showed, and what keeps the log from being judged with it.

    Args:
        text: of the configuration.
        output: the file it was written to, None for none.
        trial: of the draft on the log.
        missing: reasons; empty when the log was judged.
    """
    content = {
        "schema": INIT_SCHEMA,
        "file": None if output is None else str(output),
        "toml": text,
        "guesses": text.count("GUESS:"),
        "judged": not missing,
        "verdict": None if trial.result is None else trial.result.verdict,
        "missing": list(missing),
        "findings": [asdict(finding) for finding in trial.findings],
    }
    return json_text(content, indent=2)
