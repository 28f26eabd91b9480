"""The command line ``bisplat``.

Commands write results to files, progress to stderr and tables to stdout. An error is one sentence on stderr; the exit
status is then 1.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from bisplat.shell import SENTENCE, STATUS, STDOUT, give_up_stdout, heed_interrupts, prepare_streams

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

PROGRAM = "bisplat"
HINT = " (BISPLAT_TRACEBACK=1 shows the traceback)"
"""What follows an error whose traceback helps the user, such as one of the user's own class."""


def main() -> None:
    """Run a command. A mistake of the user ends in one sentence."""
    heed_interrupts()  # first, since the imports of the commands take a moment
    prepare_streams()
    try:
        try:
            if sys.argv[1:2] == ["convert"]:  # what ``dataset`` was called for pictures; scripts still say so
                sys.argv[1] = "dataset"
            _run(sys.argv[1:])
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        print(SENTENCE, file=sys.stderr)
        raise SystemExit(STATUS) from None
    except BrokenPipeError:  # the program that reads the output, such as head, has closed it
        give_up_stdout()
        raise SystemExit(1) from None
    except OSError as error:
        give_up_stdout()
        refuse(f"{STDOUT}: {error.strerror}", hint="")


def _run(given: list[str]) -> None:
    import tyro

    from bisplat.commands.command_groups import COMMANDS, overview, stated_version
    from bisplat.commands.common_options import REGISTRY
    from learn.training.registry import is_of_own_code
    from scenes.files.errors import InputError, ParameterError
    from scenes.files.long_work import doing, told
    from scenes.files.plain_text import warning_once

    try:
        if given in ([], ["-h"], ["--help"]):
            print(overview())
        elif given == ["--version"]:
            print(stated_version())
        else:
            check_spelling(COMMANDS)
            _refuse_repeated(given)
            with warning_once(), told():
                if not {"torch", "-h", "--help"} & {*sys.modules, *given}:
                    doing(f"{given[0]}: loading what it needs")
                tyro.extras.subcommand_cli_from_dict(COMMANDS, prog=PROGRAM, registry=REGISTRY)
    except InputError as error:
        sentence = error.as_option() if isinstance(error, ParameterError) else str(error)
        refuse(sentence, HINT if is_of_own_code(error.__cause__) else "")
    except OSError as error:
        if isinstance(error, BrokenPipeError) or error.filename == STDOUT:
            raise
        refuse(f"{error.filename}: {error.strerror}" if error.filename else str(error), "" if error.filename else HINT)
    except MemoryError as error:
        refuse(f"expected enough memory for these numbers and files, found too little ({error})")


def _refuse_repeated(given: list[str]) -> None:
    """Refuse an option that is given twice, since the parser would use the last one alone."""
    from scenes.files.errors import InputError

    names = [word.partition("=")[0] for word in given if word.startswith("--")]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name}: expected once, with all its values, found {names.count(name)} times")


def check_spelling(named: Mapping[str, Callable[..., None]]) -> None:
    """Let the parser refuse control characters in escaped form, since its errors repeat the arguments."""
    import functools

    import tyro

    from bisplat.commands.common_options import REGISTRY
    from scenes.files.errors import printable

    escaped = [printable(argument) for argument in sys.argv[1:]]
    if escaped == sys.argv[1:]:
        return
    idle: dict[str, Any] = {name: functools.wraps(command)(lambda *_, **__: None) for name, command in named.items()}
    tyro.extras.subcommand_cli_from_dict(idle, prog=PROGRAM, args=escaped, registry=REGISTRY)


def refuse(sentence: str, hint: str = HINT) -> None:
    """Print an error and exit with status 1; with ``BISPLAT_TRACEBACK=1`` also print the traceback."""
    from scenes.files.plain_text import say

    if os.environ.get("BISPLAT_TRACEBACK", "0") != "0":
        import traceback

        traceback.print_exc()
        hint = ""
    say(f"{sentence}{hint}")
    raise SystemExit(1) from None


if __name__ == "__main__":
    main()
