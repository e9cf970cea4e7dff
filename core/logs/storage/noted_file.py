"""A file whose damage is noted while it is read."""

from __future__ import annotations

from collaudit.core.logs.storage.file_reading import RandomFile
from collaudit.core.logs.storage.records import Damage

#: Further places of damage are not listed.
MAX_DAMAGE = 20


class NotedFile:
    """What readers of message files share.

    Attributes:
        file: the opened file.
        damage: what was found wrong so far, each place once.
    """

    file: RandomFile
    damage: list[Damage]

    def close(self) -> None:
        """Release the file."""
        self.file.close()

    def _note(self, text: str, *, lost: bool = True) -> None:
        damage = Damage(text, lost)
        if damage not in self.damage and len(self.damage) < MAX_DAMAGE:
            self.damage.append(damage)
