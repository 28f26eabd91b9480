"""The command line ``bisplat``.

Commands write results to files, progress to stderr and tables to stdout. An error is one sentence on stderr; the exit
status is then 1.
"""

from __future__ import annotations

import functools
import os
import sys
import traceback
from collections.abc import Callable, Mapping
from typing import Any

import tyro

from bisplat.commands.command_groups import COMMANDS, overview, stated_version
from bisplat.commands.number_options import REGISTRY
from scenes.files.errors import InputError, ParameterError, printable
from scenes.files.extras import MissingExtraError
from scenes.files.plain_text import say

PROGRAM = "bisplat"


def main() -> None:
    """Run a command. A mistake of the user ends in one sentence."""
    given = sys.argv[1:]
    try:
        if given in ([], ["-h"], ["--help"]):
            print(overview())
        elif given == ["--version"]:
            print(stated_version())
        else:
            check_spelling(COMMANDS)
            tyro.extras.subcommand_cli_from_dict(COMMANDS, prog=PROGRAM, registry=REGISTRY)
    except ParameterError as error:
        refuse(error.as_option())
    except MissingExtraError as error:
        refuse(str(error), hint="")  # it ends with a command to copy
    except InputError as error:
        refuse(str(error))
    except BrokenPipeError:  # the program that reads the output, such as head, has closed it
        raise SystemExit(1) from None
    except OSError as error:
        refuse(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except MemoryError as error:
        refuse(f"expected enough memory for these numbers and files, found too little ({error})")
    except KeyboardInterrupt:
        say("interrupted; run the same command again to continue")
        raise SystemExit(130) from None


def check_spelling(named: Mapping[str, Callable[..., None]]) -> None:
    """Let the parser refuse control characters in escaped form, since its errors repeat the arguments.

    Without control characters nothing happens.

    Args:
        named: the commands by their names; none is run.
    """
    escaped = [printable(argument) for argument in sys.argv[1:]]
    if escaped == sys.argv[1:]:
        return
    idle: dict[str, Any] = {name: functools.wraps(command)(lambda *_, **__: None) for name, command in named.items()}
    tyro.extras.subcommand_cli_from_dict(idle, prog=PROGRAM, args=escaped, registry=REGISTRY)


def refuse(sentence: str, hint: str = " (BISPLAT_TRACEBACK=1 shows the traceback)") -> None:
    """Print an error and exit with status 1; with ``BISPLAT_TRACEBACK=1`` also print the traceback.

    Args:
        sentence: the error.
        hint: what follows it where there is no traceback.
    """
    if os.environ.get("BISPLAT_TRACEBACK", "0") != "0":
        traceback.print_exc()
        hint = ""
    say(f"{sentence}{hint}")
    raise SystemExit(1) from None


if __name__ == "__main__":
    main()
