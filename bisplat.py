"""The command line. Results go to files, progress to stderr, tables to stdout; errors are one sentence, exit 1."""

from __future__ import annotations

import sys

import tyro
from learn.comparison.commands import ablate, compare, sweep

from learn.commands import check, crossvalidate, demo, evaluate, export, predict, train
from learn.view.command import view
from scenes.command import scene
from scenes.errors import InputError, ParameterError
from simulate.command import simulate


def main() -> None:
    """Run a command; turn what a user can mend into one sentence."""
    commands = (
        demo, scene, simulate, check, train, evaluate, crossvalidate, predict, export, compare, ablate, sweep, view
    )  # fmt: skip
    named = {command.__name__: command for command in commands}
    try:
        tyro.extras.subcommand_cli_from_dict(named, prog="bisplat", description=__doc__)
    except InputError as error:
        sentence = error.as_option() if isinstance(error, ParameterError) else error
        print(f"bisplat: {sentence}", file=sys.stderr)
        raise SystemExit(1) from None
    except BrokenPipeError:  # the reader of our output has had enough
        raise SystemExit(1) from None
    except OSError as error:
        print(f"bisplat: {error.filename or 'file'}: {error.strerror or error}", file=sys.stderr)
        raise SystemExit(1) from None
    except KeyboardInterrupt:
        print("bisplat: interrupted; the same command again goes on from here", file=sys.stderr)
        raise SystemExit(130) from None


if __name__ == "__main__":
    main()
