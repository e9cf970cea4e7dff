"""The data of the page's own plots as a block of JSON that no text can break out of."""

from __future__ import annotations

import json

from markupsafe import Markup

from collaudit.reports.page.view import AuditView


def signal_block(view: AuditView) -> Markup | None:
    """Curves of every joint of one audit; None where no joint has a residual."""
    joints = [{"id": f"{view.key}-joint-{k}"} | dict(f.data) for k, f in enumerate(view.figures, 1) if f.data]
    if not joints:
        return None
    text = json.dumps({"end": view.end_s, "joints": joints}, allow_nan=False, separators=(",", ":"))
    for char in "<>&\u2028\u2029":
        text = text.replace(char, f"\\u{ord(char):04x}")
    return Markup(text)
