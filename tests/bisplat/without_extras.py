"""Program: runs commands in turn as if no extra were installed, and prints what became of each as JSON.

python -m tests.bisplat.without_extras '[["check", "s23"], ["simulate", "lab", "-o", "lab"]]'
"""

import contextlib
import io
import json
import sys
import traceback
from importlib.machinery import PathFinder
from importlib.metadata import Distribution, PackageNotFoundError

MODULES = {
    "sionna", "mitsuba", "drjit", "viser", "websockets", "ray", "onnx", "onnx_ir", "onnxscript", "onnxruntime",
    "gprMax",
}  # fmt: skip
"""What the extras bring."""

DISTRIBUTIONS = MODULES - {"sionna"} | {"sionna-rt"}


class Absent(PathFinder):
    """Finds all modules but those of the extras."""

    @classmethod
    def find_spec(cls, fullname, path=None, target=None):
        return None if fullname.partition(".")[0] in MODULES else super().find_spec(fullname, path, target)


def hide_extras() -> None:
    """Make imports of the extras fail, and their versions unknown."""
    sys.meta_path[:] = [Absent if each is PathFinder else each for each in sys.meta_path]
    installed = Distribution.from_name

    def found(name: str) -> Distribution:
        if name in DISTRIBUTIONS:
            raise PackageNotFoundError(name)
        return installed(name)

    Distribution.from_name = found


def outcome(command: list[str]) -> tuple[int, str]:
    """Run a command."""
    from bisplat.__main__ import main

    sys.argv = ["bisplat", *command]
    said, status = io.StringIO(), 0
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        try:
            main()
        except SystemExit as end:
            status = end.code or 0
        except Exception:  # noqa: BLE001  as Python itself ends
            traceback.print_exc()
            status = 1
    return status, said.getvalue()


if __name__ == "__main__":
    hide_extras()
    print(json.dumps([outcome(command) for command in json.loads(sys.argv[1])]))
