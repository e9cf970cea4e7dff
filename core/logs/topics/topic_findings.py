"""What decoding a topic showed: messages left out, and how long after publishing they were recorded."""

from __future__ import annotations

from collaudit.core.findings import Finding
from collaudit.core.logs.topics.log_topics import Topic

#: Recording that begins so much before publishing, or ends so much after, is worth a warning.
LATE_S = 0.1
_SAME_S = 1e-6


def skipped_findings(topic: Topic) -> tuple[Finding, ...]:
    """Findings for messages of a topic that were left out."""
    decoded = topic.decoded
    if not decoded.skipped:
        return ()
    text = f"{decoded.skipped} of {decoded.seen} messages were left out; the first because {decoded.problem}."
    return (Finding("log-message-skipped", "warning", text, where=topic.name),)


def publish_findings(topic: Topic) -> list[Finding]:
    """What the times of publishing of a topic show; nothing where they are those of recording."""
    latency = topic.decoded.latency
    if latency.unset and not latency.count:
        text = "No message says when it was published (its stamp is zero)."
        return [Finding("clock-publish", "info", text, where=topic.name)]
    low, high = latency.least / 1e9, latency.most / 1e9
    if max(-low, high) < _SAME_S:
        return []
    mean = latency.total / latency.count / 1e9
    text = (
        f"Messages were recorded {mean * 1e3:.4g} ms after they were published, from {low * 1e3:.4g} to "
        f"{high * 1e3:.4g} ms; the time of publishing is not used."
    )
    if low < 0:
        text += " Some were recorded before they were published: their clocks differ."
    odd = low < -_SAME_S or high - low > LATE_S
    return [Finding("clock-publish", "warning" if odd else "info", text, where=topic.name)]
