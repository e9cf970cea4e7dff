"""Studies of rules in the commands: asked for, and printed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from collaudit.cli.console import note, say, terminal_width

if TYPE_CHECKING:
    from collaudit.core.config import LoadedConfig
    from collaudit.core.data.audit_result import Audit

#: Studies that are printed: what one log tells of its rule, others tell alike.
_MOST = 2


def with_study(loaded: LoadedConfig) -> LoadedConfig:
    """The same settings, with a study of the rule."""
    study = loaded.config.study.model_copy(update={"run": True})
    return replace(loaded, config=loaded.config.model_copy(update={"study": study}))


def say_studies(audits: Sequence[Audit], detail: bool = False) -> None:
    """Print the studies of audits that have one; a note says how to get one for those that have none."""
    from collaudit.reports.terminal.study_text import study_text

    studies = [audit.study for audit in audits if audit.study is not None]
    for study in studies[:_MOST]:
        title = f"\nWhat the rule notices in {study.log}" if len(audits) > 1 else "\nWhat the rule notices"
        say(f"{title}\n\n{study_text(study, terminal_width(), detail)}", nl=False)
    if len(studies) > _MOST:
        note(f"{len(studies) - _MOST} more studies are not printed; --json has all")
    if not studies:
        note("what the rule notices is not known of these runs: collaudit detect --study finds it out")
