"""What flags state of each log: contact (files, labels, or that there is none), and the load that the arm carries."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.settings import all_of, free_option, labels_option
from collaudit.core.errors import ConfigError
from collaudit.core.scoring.detection_score import TruthFile, read_truth

if TYPE_CHECKING:
    from collaudit.core.prepare.known_load import KnownLoad

_NUMBERS = (1, 4)


#: ``--truth``, ``--labels`` and ``--free-of-contact``.
contact_options = all_of(
    click.option(
        "--truth",
        multiple=True,
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Known contacts, left out: NAME.truth.json, or a .csv with onset_s, end_s; once for each input, in order.",
    ),
    labels_option,
    free_option,
)


def known_contact(files: Sequence[Path], inputs: int) -> list[TruthFile | None]:
    """Truth files of the inputs; empty where none is given.

    Raises:
        ConfigError: not one for each input. LogError: one cannot be read.
    """
    if files and len(files) != inputs:
        raise ConfigError(
            "known contacts are given for some of the inputs only",
            where="--truth",
            found=f"{len(files)} files for {inputs} inputs",
            expected="one for each, in their order",
        )
    return [read_truth(file) for file in files]


def known_loads(texts: Sequence[str], inputs: int) -> list[KnownLoad]:
    """Loads of the inputs; empty where none is given.

    Raises:
        ConfigError: not one for each input, or no mass and place.
    """
    from collaudit.core.prepare.known_load import KnownLoad

    if texts and len(texts) != inputs:
        raise ConfigError(
            "known loads are given for some of the logs only",
            where="--load",
            found=f"{len(texts)} for {inputs} logs",
            expected="one for each, in their order; 0 for none",
        )
    out = []
    for text in texts:
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) not in _NUMBERS or not 0.0 <= numbers[0] < 1e4 or not all(abs(x) < 1e3 for x in numbers[1:]):
            raise ConfigError("this is no load", where="--load", found=text, expected="KG or KG,X,Y,Z (m)")
        place = (numbers[1], numbers[2], numbers[3]) if len(numbers) > 1 else (0.0, 0.0, 0.0)
        out.append(KnownLoad(numbers[0], place))
    return out
