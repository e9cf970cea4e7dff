"""What is known of contact in logs to be fitted or recommended from: files, labels, or that there is none."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from collaudit.cli.settings import CommandFunction, free_option, labels_option
from collaudit.core.errors import ConfigError
from collaudit.core.scoring.detection_score import TruthFile, read_truth


def contact_options(function: CommandFunction) -> CommandFunction:
    """The flags ``--truth``, ``--labels`` and ``--free-of-contact``."""
    truth = click.option(
        "--truth",
        multiple=True,
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Known contacts, left out: NAME.truth.json, or a .csv with onset_s, end_s; once for each input, in order.",
    )
    return truth(labels_option(free_option(function)))


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
