"""Joint states whose parts come apart: efforts on a topic of their own, and messages without usable stamps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.stamps import seconds_since
from collaudit.core.logs.topics.log_topics import Topic
from collaudit.core.logs.topics.topic_series import Series, publishers_of
from collaudit.core.numeric.stats import median_of

#: A stated rate may be so many times that at which messages were received.
_RATE = 1.25
#: Messages that are written in bursts wait for at most so many of the usual times between two bursts.
_BURSTS = 2.5

#: Messages of one time of recording in a burst: two may be of two publishers. Fewer times tell nothing.
_BURST, _FEWEST = 3, 3


def with_efforts(publishers: Sequence[Series], topic: Topic, keep: frozenset[str], where: str) -> list[Series]:
    """Publishers with the efforts of another topic in place of their own.

    The first, onto whose stamps the others are brought, is the slower one: positions are smooth between two stamps, and
    efforts are not.

    Args:
        publishers: of the joint states.
        topic: of the efforts, decoded; its groups are used up.
        keep: log names wanted.
        where: the log, for messages.

    Raises:
        LogError: it has no efforts of these joints.
    """
    named = tuple(name for key in topic.decoded.groups for name in key.names)
    found = publishers_of(topic.decoded, keep)
    own = [replace(p, columns={"effort": p.columns["effort"]}) for p in found if "effort" in p.columns]
    if not own:
        raise LogError(
            f"the topic {topic.name} holds no efforts of the joints",
            where=where,
            found=f"joints {listed(tuple(dict.fromkeys(named)))}",
            expected=listed(sorted(keep)),
            hint="both topics must name the joints alike; where messages have no names, [log.fields] names gives them",
        )
    rest = [replace(p, columns={name: x for name, x in p.columns.items() if name != "effort"}) for p in publishers]
    slower = own[0].log_ns.shape[0] < rest[0].log_ns.shape[0]
    return [*own, *rest] if slower else [*rest, *own]


def spaced_evenly(series: Series, rate_hz: float, where: str) -> Series:
    """Messages stamped at a stated rate in the order of recording.

    Args:
        series: of one publisher.
        rate_hz: of its messages.
        where: log and topic, for messages.

    Raises:
        LogError: they were received at another rate, or some are missing in between.
    """
    received = seconds_since(series.log_ns, int(series.log_ns[0]))
    time_s = np.arange(received.shape[0]) / rate_hz
    steps = np.diff(np.unique(received))
    if steps.size:
        told = (received.shape[0] - 1) / float(received[-1])
        if not 1.0 / _RATE <= rate_hz / told <= _RATE:
            found = f"{received.shape[0]} messages in {received[-1]:.4g} s: {told:.4g} a second"
            raise LogError(
                f"[log] rate_hz = {rate_hz:g} is not the rate of the messages",
                where=where,
                found=found,
                hint="state the rate at which they were sent; where messages are missing, no rate tells their times",
            )
        late = received - time_s
        late -= np.polynomial.Polynomial.fit(time_s, late, 1)(time_s)
        allowed = _BURSTS * median_of(steps)
        if float(np.ptp(late)) > allowed:
            at = int(np.argmax(np.diff(late)))
            raise LogError(
                "messages are missing, so that no rate tells when the others were taken",
                where=where,
                found=f"{received[at + 1] - received[at]:.3g} s without messages after {received[at]:.4g} s",
                hint="record with stamps in the header, or judge its parts: [log] from_s, to_s",
            )
    stamps = series.log_ns[0] + np.rint(time_s * 1e9).astype(np.int64)
    return replace(series, stamp_ns=stamps, stamp_breaks=())


def check_clocks(series: Series, where: str) -> None:
    """Refuse messages that hold no stamp and were received in bursts: nothing tells when they were taken.

    Args:
        series: of one publisher.
        where: log and topic, for messages.

    Raises:
        LogError: naming the key that states their rate.
    """
    if series.stamp_ns is not None and bool((series.stamp_ns != series.stamp_ns[0]).any()):
        return
    rows, times = series.log_ns.shape[0], int(np.count_nonzero(np.diff(series.log_ns) > 0)) + 1
    if times < _FEWEST or rows < _BURST * times:
        return
    raise LogError(
        "no stamp tells when the messages were taken",
        where=where,
        found=f"no stamps in the header; {rows} messages were received in {times} bursts",
        expected="stamps in the header, or a time of recording for each message",
        hint="state how many messages were sent a second, with your own number: [log] rate_hz = 500.0",
    )
