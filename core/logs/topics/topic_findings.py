"""What decoding a topic showed: messages left out."""

from __future__ import annotations

from collaudit.core.findings import Finding
from collaudit.core.logs.topics.log_topics import Topic


def skipped_findings(topic: Topic) -> tuple[Finding, ...]:
    """Findings for messages of a topic that were left out."""
    decoded = topic.decoded
    if not decoded.skipped:
        return ()
    text = f"{decoded.skipped} of {decoded.seen} messages were left out; the first because {decoded.problem}."
    return (Finding("log-message-skipped", "warning", text, where=topic.name),)
