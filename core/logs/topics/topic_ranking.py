"""Which of several topics is meant by the joint states: one ranking for every command and every hint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.logs.messages.decoded_columns import Decoded
from collaudit.core.logs.signals.signal_roles import is_usable, role_of_path, strongest
from collaudit.core.logs.topics.log_topics import CONFIGURED, Topic, named
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.channel_noise import bend_of, noise_of
from collaudit.core.vendors.column_words import USABLE, Role

#: Messages that noise is told from.
_ROWS = 20_000


@dataclass(frozen=True, slots=True)
class TopicFacts:
    """What ranks a topic of joint states.

    Attributes:
        name: of the topic.
        known: how many of the robot's joints it has; 0 where no robot is known.
        role: what its efforts are, as of :func:`role_of`.
        position: whether it has positions.
        effort: whether it has efforts.
        noise: whether they have a sensor's noise; a model's are smooth.
        joints: how many joints it has.
        count: messages.
    """

    name: str
    known: int
    role: Role
    position: bool
    effort: bool
    noise: bool
    joints: int
    count: int

    @property
    def decisive(self) -> tuple[int, bool, bool, bool, bool, int]:
        """Smaller comes first: most of the robot's joints, measured, with positions, with efforts, with noise in them.

        Between topics that are equal in this a person decides.
        """
        usable = is_usable(self.role)
        return (
            -self.known,
            not usable,
            not self.position,
            not self.effort,
            not self.noise,
            USABLE.index(self.role) if usable else 0,
        )


def role_of(topic: Topic, settings: LogConfig) -> Role:
    """What the efforts of a topic are: by its name and the stated path of their field, unless all of it is stated."""
    if settings.effort_kind != "auto" and named([topic], settings.efforts or settings.joint_states) is not None:
        return "measured"
    field = topic.profile.effort if topic.profile.name == CONFIGURED else None
    return strongest({role_of_path(topic.name), role_of_path(field or "")})


def holds(parts: Sequence[Decoded], quantity: str) -> bool:
    """Whether any message has a number of a quantity."""
    return any(group.holds(quantity) for decoded in parts for group in decoded.groups.values())


def has_noise(parts: Sequence[Decoded]) -> bool:
    """Whether any joint's effort has a sensor's noise."""
    efforts = (group.look("effort") for decoded in parts for group in decoded.groups.values())
    return any(_noisy(np.ascontiguousarray(x)) for values in efforts if values is not None for x in values[:_ROWS].T)


def _noisy(x: FloatArray) -> bool:
    return bool(np.isfinite(x).any()) and noise_of(x, bend_of(x), np.ones(x.size, dtype=np.bool_)).measured


def in_order(topics: Sequence[TopicFacts]) -> list[TopicFacts]:
    """Topics from the likeliest on; of those that nothing decides between, the one with most joints, then messages."""
    return sorted(topics, key=lambda topic: (topic.decisive, -topic.joints, -topic.count, topic.name))


def foremost(topics: Sequence[TopicFacts]) -> list[TopicFacts]:
    """The topics that nothing decides between, of those that come first, in order."""
    ordered = in_order(topics)
    return [topic for topic in ordered if topic.decisive == ordered[0].decisive]
