"""The entry point: one group of commands, and the one place where errors become words and exit codes."""

from __future__ import annotations

import atexit
import gc
import json
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress

import click

from collaudit.cli.console import note, say_json, silence_library_warnings
from collaudit.cli.group import LazyGroup
from collaudit.core.errors import (
    EXIT_INTERRUPTED,
    EXIT_NOT_JUDGED,
    EXIT_TERMINATED,
    EXIT_USAGE,
    CollauditError,
    NotJudgedError,
)
from collaudit.core.numeric.linear_algebra import memory_is_limited, one_thread_of_linear_algebra

#: Objects made before a round of garbage collection. Imports make many and leave next to no garbage.
_COLLECT_AFTER = 200_000
_EXIT_BROKEN_PIPE = 141  # what a shell reports for a program that nobody reads any more

#: How the dynamic loader says that a library did not fit, and Python and Arrow that the stack of a thread did not.
_WITHOUT_MEMORY = ("failed to map segment from shared object", "cannot map zero-fill pages", "Cannot allocate memory")
_WITHOUT_THREAD = ("can't start new thread", "Failed to launch worker thread")
#: Said where no memory is left to say what happened; made while there is some.
_LAST_WORDS = b"not enough memory to say what ended this command: nothing was judged\n"
_COMMANDS = {
    "inspect": "What is in a log: topics, joints, rates, gaps, units, findings.",
    "init": "Write a commented configuration for a log.",
    "fit": "Identify friction from constant-velocity motion.",
    "detect": "Judge one log: residuals, contacts, near misses.",
    "explain": "Which cause takes a log's residual away, and what to state.",
    "recommend": "Recommend thresholds with their evidence.",
    "report": "Write the report of finished runs.",
    "audit": "Everything above, for one log or thousands.",
    "plan": "Plan the motion that would settle what the data leave open.",
    "trend": "The nights of a store: tested, contacts, level, γ, friction.",
    "query": "Ask a store of results in SQL.",
    "store": "Prune stored nights by age and size, the plan first.",
    "check": "Check configurations without a log.",
    "accept": "Take one contact out of verdicts, by name and until a day.",
    "simulate": "Make a log whose truth is known.",
    "selftest": "Prove this installation on logs whose truth is known.",
    "demo": "The whole chain on simulated runs; ends with a report.",
}
_HOMES = {
    **dict.fromkeys(("inspect", "detect", "explain"), "logs"),
    **dict.fromkeys(("init", "check"), "configs"),
    **dict.fromkeys(("fit", "plan"), "friction"),
    **dict.fromkeys(("trend", "query", "store"), "nights"),
    **dict.fromkeys(("simulate", "selftest", "demo"), "known_truth"),
}
ERROR_SCHEMA = "collaudit/error/1"


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option(
    "--debug", is_flag=True, expose_value=False, help="Show tracebacks of unexpected errors (also COLLAUDIT_DEBUG=1)."
)
@click.version_option(package_name="collaudit", message="%(package)s %(version)s", help="Show the version.")
def collaudit() -> None:
    """Audit robot logs for collisions: friction, residual torque, evidence.

    Reads recorded logs after the fact. It is no safety function and claims no performance level.

    Exit codes: 0 judged, policy kept; 1 judged, policy broken; 2 usage or configuration error, or a bug;
    3 something could not be judged; 130 interrupted.
    """


collaudit.summaries, collaudit.homes = _COMMANDS, _HOMES
collaudit.examples = (
    "collaudit demo",
    "collaudit inspect run.mcap",
    "collaudit init run.mcap --urdf arm.urdf -o collaudit.toml",
    "collaudit audit logs/ -c collaudit.toml -o out/",
)


class _Terminated(BaseException):
    """SIGTERM, as an exception: temporary files and worker processes end with the command."""


def _interrupt(_number: int, _frame: object) -> None:
    signal.signal(signal.SIGINT, _again)  # SIGTERM still ends it
    raise KeyboardInterrupt


def _terminate(_number: int, _frame: object) -> None:
    signal.signal(signal.SIGTERM, _again)
    raise _Terminated


def _again(_number: int, _frame: object) -> None:
    """A second signal, which would interrupt the clearing up; where this is the handler, a first one has arrived."""


def _cause(error: BaseException) -> BaseException:
    """What ended the command: the signal where one arrived, and what is short where libraries fail for want of it."""
    if signal.getsignal(signal.SIGTERM) is _again:
        return _Terminated()
    if signal.getsignal(signal.SIGINT) is _again:
        return KeyboardInterrupt()
    short, said = "", str(error)
    if isinstance(error, MemoryError):
        error.__traceback__ = error.__context__ = None  # its frames hold the memory that is missing
        short = "not enough memory for this log"
    elif isinstance(error, ImportError) and any(words in said for words in _WITHOUT_MEMORY):
        short = "not enough memory to load the program"
    elif isinstance(error, SystemError):  # compiled code that finds no memory for its own error
        short = "a library ended without a reason, as where memory is short"
    elif not isinstance(error, CollauditError) and any(words in said for words in _WITHOUT_THREAD):
        short = "no thread could be started, which memory or the number of processes forbids"
    return NotJudgedError(f"{short}: nothing was judged", found=said or None) if short else error


def main(args: Sequence[str] | None = None) -> None:
    """Run the command line and exit with the contracted code.

    What fails while an error is said, for want of memory as a rule, ends here: Python would answer with exit code 1,
    which says that a policy is broken. Nothing is allocated on this way out.
    """
    try:
        code = _started(args)
    except KeyboardInterrupt:
        os._exit(EXIT_INTERRUPTED)
    except BaseException:  # noqa: BLE001 - whatever it is, it is no verdict
        with suppress(OSError):  # nobody reads it any more
            os.write(2, _LAST_WORDS)
        os._exit(EXIT_NOT_JUDGED)
    sys.exit(code)


def _started(args: Sequence[str] | None) -> int:
    _open_standard_streams()
    one_thread_of_linear_algebra()
    gc.set_threshold(_COLLECT_AFTER, 10, 20)
    # What is left goes with the process: ending, Python would look through all of it several times for cycles.
    atexit.register(gc.freeze)
    silence_library_warnings()
    signal.signal(signal.SIGTERM, _terminate)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # who started us may have it ignored
        signal.signal(signal.SIGINT, _interrupt)
    code = run(list(sys.argv[1:] if args is None else args))
    if code == EXIT_NOT_JUDGED and memory_is_limited():
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):  # nobody reads it any more
                stream.flush()
        os._exit(code)  # libraries that got no memory can crash at the end of a process, which changes its exit code
    return code


def _open_standard_streams() -> None:
    """Give stdin, stdout and stderr that the caller closed a place that holds nothing.

    Left closed, their numbers would go to the next files that are opened, and text for people would be written there.
    """
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is None:
            try:
                os.fstat(number)
            except OSError:
                os.dup2(os.open(os.devnull, os.O_RDWR), number)
            setattr(sys, name, open(number, mode, closefd=False))  # noqa: SIM115 - lives as long as the process


def run(args: list[str]) -> int:
    """Run one command and return its exit code; every exception ends here."""
    debug = args[:1] == ["--debug"] or os.environ.get("COLLAUDIT_DEBUG", "") not in ("", "0")
    if debug:
        os.environ["COLLAUDIT_DEBUG"] = "1"  # what worker processes see
    color = False if os.environ.get("NO_COLOR") else None
    try:
        code = collaudit.main(args=args, prog_name="collaudit", standalone_mode=False, color=color)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except SystemExit as error:  # click answers a closed pipe by leaving with 1, which here would say "policy broken"
        _leave_stdout()
        return _EXIT_BROKEN_PIPE if error.code == 1 else int(error.code or 0)
    except BrokenPipeError:
        _leave_stdout()
        return _EXIT_BROKEN_PIPE
    except BaseException as error:  # noqa: BLE001 - the last line of defence: a bug must not look like a verdict
        return _answer(_cause(error), args, debug)


def _answer(error: BaseException, args: list[str], debug: bool) -> int:
    """Say what ended the command, to whoever still reads it, and return its exit code."""
    try:
        code = _say_error(error, args, debug)
    except BrokenPipeError:
        sys.stderr = open(os.devnull, "w")  # noqa: PTH123, SIM115 - lives until the interpreter ends
        code = _say_error(error, args, debug)
    if _wants_json(args):
        try:
            content: dict[str, object] = {"schema": ERROR_SCHEMA, "exit_code": code, **_facts(error)}
            say_json(json.dumps(content, indent=2, allow_nan=False) + "\n")
            sys.stdout.flush()
        except BrokenPipeError:
            _leave_stdout()
    return code


def _say_error(error: BaseException, args: list[str], debug: bool) -> int:
    if isinstance(error, KeyboardInterrupt | click.Abort):
        note("interrupted")
        return EXIT_INTERRUPTED
    if isinstance(error, _Terminated):
        note("terminated")
        return EXIT_TERMINATED
    if isinstance(error, click.ClickException):
        error.show()
        return EXIT_USAGE
    if isinstance(error, CollauditError):
        note(error.render())
        return error.exit_code
    if debug:
        traceback.print_exception(error)
    if isinstance(error, OSError):
        note(f"{error.filename or 'input or output'}: {error.strerror or error}")
    else:
        note(
            f"collaudit failed unexpectedly: {type(error).__name__}: {error}\n"
            "  This is a bug, and nothing was judged. Please report it with the output of\n"
            f"  collaudit --debug {' '.join(args[1:] if args[:1] == ['--debug'] else args)}"
        )
    return EXIT_USAGE


def _leave_stdout() -> None:
    """Nobody reads stdout any more: what is still to be written goes nowhere."""
    sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 - lives until the interpreter ends


def _wants_json(arguments: Sequence[str]) -> bool:
    """Whether a command line asks for JSON; what follows ``--`` is no option."""
    before = arguments[: arguments.index("--")] if "--" in arguments else arguments
    return "--json" in before


def _facts(error: BaseException) -> dict[str, object]:
    if isinstance(error, CollauditError):
        names = ("message", "where", "found", "expected", "hint")
        return {"kind": type(error).__name__, **{name: _plain(getattr(error, name)) for name in names}}
    if isinstance(error, click.ClickException):
        return {"kind": "UsageError", "message": error.format_message()}
    if isinstance(error, OSError):
        return {"kind": "OSError", "message": error.strerror or str(error), "where": _plain(error.filename)}
    return {"kind": type(error).__name__, "message": str(error)}


def _plain(value: object) -> str | None:
    return None if value is None else str(value).encode("utf-8", "backslashreplace").decode("utf-8")
