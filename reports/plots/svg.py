"""Matplotlib figures as inline SVG: the same figure always gives the same text.

No text from a log is ever drawn by matplotlib (names stand in the page around the plot), so no name can
be taken for mathematics or markup, and what comes out may be put into the page as it is.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, cast

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

INK = "#1a1a1a"
CURVE = "#0b4f8a"
MUTED = "#9a9a9a"
STANDING = "#5f93bd"
LIMIT = "#b00020"
NEAR = "#8a5a00"
ONSET = "#6a3d9a"
MODEL = "#c26a00"
SHADE_STANDING = "#f5eedb"
SHADE_OUT = "#e4e4e4"

_STYLE = {
    "svg.fonttype": "none",
    "svg.image_inline": True,
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": "#555555",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 7),
    "axes.unicode_minus": True,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "lines.linewidth": 1.0,
    "lines.solid_joinstyle": "round",
    "hatch.linewidth": 0.5,
    "path.simplify": False,
    "text.parse_math": False,
    "text.usetex": False,
}
_ID = re.compile(r'\bid="([^"]+)"')
_USED = re.compile(r'(?:href="#|url\(#)([^")]+)')
_NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}


@contextmanager
def drawing(name: str) -> Iterator[None]:
    """The plot style, and ids that depend on nothing but ``name`` and the drawing's content."""
    with mpl.rc_context():
        mpl.rcdefaults()  # not the reader's own matplotlibrc
        mpl.rcParams.update(cast(Any, {**_STYLE, "svg.hashsalt": f"collaudit {name}"}))
        yield


def figure(width_in: float, height_in: float) -> Figure:
    """An empty figure that pyplot does not know of."""
    made = Figure(figsize=(width_in, height_in), facecolor="none")
    FigureCanvasSVG(made)
    return made


def inline(drawn: Figure, name: str, label: str) -> Markup:
    """The figure as an ``<svg>`` element for a page that holds many of them.

    Args:
        drawn: the figure.
        name: unique in the page; letters, digits and hyphens. Every id of the drawing begins with it.
        label: what the plot shows, for those who cannot see it; may hold any text.
    """
    buffer = io.StringIO()
    drawn.savefig(buffer, format="svg", metadata=_NO_METADATA)
    text = buffer.getvalue()
    body = text[text.index("<svg") :]
    view_box = re.search(r'viewBox="([^"]+)"', body)
    assert view_box is not None
    body = body[body.index(">") + 1 : body.rindex("</svg>")]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r"<style\b.*?</style>", "", body, flags=re.DOTALL)
    body = re.sub(r" ?font-family: [^;\"]*;?", "", body)
    body = re.sub(r"\s*\n\s*", "\n", _own_ids(body, name))
    head = Markup('<svg class="plot" viewBox="{}" role="img" aria-label="{}">').format(view_box[1], label)
    return head + Markup(body) + Markup("</svg>")


def _own_ids(body: str, name: str) -> str:
    """Ids that nothing refers to are dropped, the others made unique in the page."""
    used = set(_USED.findall(body))
    body = _ID.sub(lambda match: f'id="{name}-{match[1]}"' if match[1] in used else "", body)
    body = body.replace("xlink:href=", "href=")
    return _USED.sub(lambda match: match[0].replace("#", f"#{name}-", 1), body)


def quiet_axis(axes: Axes) -> None:
    """Thin ticks and a light horizontal grid."""
    axes.tick_params(length=3, color="#555555", labelcolor=INK)
    axes.grid(axis="y", color="#e8e8e8", linewidth=0.5)
    axes.set_axisbelow(True)
