"""Files that lie in a folder of logs and were not judged."""

from dataclasses import dataclass
from typing import Literal

LeftOutKind = Literal["leftover", "archive", "unreadable", "other", "companion"]


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A file, or folder, that was not judged.

    Attributes:
        name: its path or URL.
        kind: ``leftover`` of a recorder or a copy that was cut; ``archive`` that holds logs, or may; ``unreadable``;
            ``other``: any other name; ``companion``: what usually lies beside logs, which is named and never counts.
        not_judged: whether it counts as a log that was not judged.
        text: why it was left out.
    """

    name: str
    kind: LeftOutKind
    not_judged: bool
    text: str
