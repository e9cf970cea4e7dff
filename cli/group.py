"""Commands whose help begins with examples, in a group that imports one when it is run; no output is an input."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import click

from collaudit.core.errors import CollauditError
from collaudit.core.numeric.linear_algebra import room_for_linear_algebra

#: An option is suggested for one at least so like it: "--fricton" and "--friction" are 0.95, "--st" and "--set" 0.89.
_ALIKE = 0.75
_RUN_FILES = ("audit.json", "signals.parquet", "friction.json")


class ExamplesFirst(click.Command):
    """A command whose help starts with examples, then usage, words and options."""

    examples: tuple[str, ...] = ()

    def format_help(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write examples as they are typed, never wrapped; then the help."""
        formatter.write("".join(["Examples:\n", *(f"  {example}\n" for example in self.examples), "\n"]))
        super().format_help(ctx, formatter)


class ExampleCommand(ExamplesFirst):
    """A command that refuses an output which is one of its inputs."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As click does it, with suggestions for an unknown option only where they are alike."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            alike = difflib.get_close_matches(error.option_name, error.possibilities or (), n=1, cutoff=_ALIKE)
            raise click.NoSuchOption(error.option_name, possibilities=alike, ctx=ctx) from None

    def invoke(self, ctx: click.Context) -> object:
        """Run the command, unless its output is one of its inputs."""
        from collaudit.cli.settings import given_paths, settings_file

        settings = {key: value for key, value in given_paths().items() if key != "friction.file"}  # is kept as it is
        takes_config = any(param.name == "config" for param in self.params)
        if takes_config and self.name != "init" and (path := settings_file()):  # init drafts it anew
            settings["config"] = str(path)
        refuse_input_as_output({**settings, **ctx.params})
        try:
            return super().invoke(ctx)
        except EOFError as error:  # click would take it for Ctrl-D, and say "interrupted"
            raise RuntimeError(f"a file ended too early: {error}") from error


class LazyGroup(ExamplesFirst, click.Group):
    """A group that imports a command only when it is asked for.

    Attributes:
        summaries: the line that the group's help shows of each command.
        homes: the module in ``cli.commands`` of each command that does not stand in one of its own name.
    """

    summaries: Mapping[str, str] = {}
    homes: Mapping[str, str] = {}

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of an audit, not of the alphabet."""
        return list(self.summaries)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command."""
        if cmd_name not in self.summaries:
            return None
        room_for_linear_algebra()
        home = import_module(f"collaudit.cli.commands.{self.homes.get(cmd_name, cmd_name)}")
        command: click.Command = getattr(home, f"{cmd_name}_command")
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click does it, with a near match for a misspelt command."""
        if args and not args[0].startswith("-") and args[0] not in self.summaries:
            close = difflib.get_close_matches(args[0], self.summaries, n=1)
            hint = f" Did you mean {close[0]!r}?" if close else ""
            ctx.fail(f"No such command {args[0]!r}.{hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List commands and summaries without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self.summaries.items()))


def example_command(name: str, *examples: str) -> Callable[[Callable[..., int]], ExampleCommand]:
    """Make a function into a command; its docstring is the help, its return value the exit code.

    Args:
        name: the command's name.
        examples: shell lines, shown first.
    """

    def wrap(function: Callable[..., int]) -> ExampleCommand:
        command = click.command(cls=ExampleCommand, name=name)(function)
        command.examples = examples
        return command

    return wrap


def refuse_input_as_output(params: Mapping[str, object]) -> None:
    """Refuse an output that one of the command's inputs already is.

    Args:
        params: arguments and options of the command, files among them.

    Raises:
        CollauditError: writing the output would destroy an input.
    """
    output = params.get("output")
    if not isinstance(output, Path):
        return
    targets = [output / name for name in _RUN_FILES] if output.is_dir() else [output]
    targets = [path for path in targets if path.is_file()]
    if not targets:
        return
    for name, value in params.items():
        if name == "output":
            continue
        for path in _files(value, runs=name == "runs"):
            if any(path.samefile(target) for target in targets):
                raise CollauditError(
                    "the output is one of the inputs, which it would replace",
                    where=str(output),
                    found=str(path),
                    hint="name another file with -o",
                )


def _files(value: object, runs: bool) -> Iterator[Path]:
    """Existing files that a parameter names: itself, what its pattern matches, the logs or results in its folder."""
    from collaudit.core.logs.inputs import expand_inputs

    values: Iterable[object] = value if isinstance(value, list | tuple) else [value]
    for item in values:
        if not item or not isinstance(item, str | Path):
            continue
        path = Path(item)
        if runs or path.is_file():
            yield from (file for file in (path, *(path / name for name in _RUN_FILES)) if file.is_file())
        else:
            with suppress(CollauditError):  # the command itself says what is wrong with its input
                yield from expand_inputs([str(item)])
