"""How much a user meets: keys, options, kinds of finding. A new one takes the place of one that nobody needs."""

from __future__ import annotations

import click

from collaudit.cli.main import collaudit
from collaudit.core.config.describe import all_keys
from collaudit.core.findings.finding_kinds import KINDS

#: Every command with settings takes these two.
COMMON = frozenset({"--config", "--set"})


def test_keys_of_the_configuration() -> None:
    assert sum(key.shape == "value" for key in all_keys()) <= 129


def test_options_are_the_everyday_ones() -> None:
    context = click.Context(collaudit)
    commands = [collaudit.get_command(context, name) for name in collaudit.list_commands(context)]
    options = [one for command in commands if command for one in command.params if isinstance(one, click.Option)]
    assert sum(COMMON.isdisjoint(one.opts) for one in options) <= 90


def test_kinds_of_finding() -> None:
    assert len(KINDS) <= 50
