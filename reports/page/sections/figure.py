"""A drawing as it stands on the page."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup


@dataclass(frozen=True, slots=True)
class Figure:
    """Anchor, joint, words about it, the SVG or None, and a note on what is left out."""

    anchor: str
    joint: str
    caption: str
    svg: Markup | None
    note: str | None = None
