"""Studies of rules in the commands: asked for, and printed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from collaudit.cli.console import note, say, terminal_width
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import Audit

#: Studies that are printed: what one log tells of its rule, others tell alike.
_MOST = 2


def with_study(loaded: LoadedConfig, per_hour: float) -> LoadedConfig:
    """The same settings, with a study of the rule for what is asked.

    Args:
        loaded: settings.
        per_hour: false alarms of the arm that are accepted.
    """
    study = loaded.config.study.changed({"run": True, "per_hour": per_hour})
    return replace(loaded, config=loaded.config.changed({"study": study}))


def say_studies(audits: Sequence[Audit], detail: bool = False, answer: bool = True) -> None:
    """Print the studies of audits that have one; a note says how to get one for those that have none.

    Args:
        audits: judged logs.
        detail: all tables.
        answer: with the rule that each log alone recommends, and what it says of the rule that is set.
    """
    from collaudit.reports.terminal.command_texts import study_text

    studies = [audit.study for audit in audits if audit.study is not None]
    for study in studies[:_MOST]:
        title = f"\nWhat the rule notices in {study.log}" if len(audits) > 1 else "\nWhat the rule notices"
        say(f"{title}\n\n{study_text(study, terminal_width(), detail, answer)}", nl=False)
    if len(studies) > _MOST:
        note(f"{len(studies) - _MOST} more studies are not printed; --json has all")
    if not studies:
        note("sensitivity to contact was not studied in these runs; collaudit detect --study does it")
