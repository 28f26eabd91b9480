"""Which libLLVM is taken, and that an old one is refused before Dr.Jit can abort the process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scenes.files.errors import InputError
from simulate.rays.core import llvm

ROOT = Path(__file__).parents[4]


def test_old_library_is_refused_before_drjit_is_imported(tmp_path):
    """With it, the first kernel would abort the process."""
    old = tmp_path / "libLLVM-15.so.1"
    old.write_bytes(b"")
    program = (
        "import sys\n"
        "from scenes.files.errors import InputError\n"
        "try:\n"
        "    import simulate.rays.tracer\n"
        "except InputError as error:\n"
        "    print('drjit' in sys.modules, error)\n"
    )
    environment = os.environ | {"DRJIT_LIBLLVM_PATH": str(old)}
    command = [sys.executable, "-c", program]
    found = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stderr
    assert found.stdout.startswith(f"False DRJIT_LIBLLVM_PATH names {old}, LLVM 15")


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ([], "install LLVM 16 or newer"),
        (["libLLVM.so"], r"/x/libLLVM\.so "),  # without a version in its name, and no library either
        (["libLLVM-14.so.1", "libLLVM-15.so.1", "libLLVM-9.so.1"], r"/x/libLLVM-15\.so\.1 \(LLVM 15\)"),
        (["libLLVM-9.so.1", "libLLVM.so.19.1", "libLLVM-16.so.1"], None),
    ],
)
def test_newest_library_is_taken_if_it_is_new_enough(names, expected, monkeypatch):
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)  # importing the ray tracer sets it
    monkeypatch.setattr(llvm, "installed_libraries", lambda: [Path("/x") / name for name in names])
    if expected is None:
        assert llvm.find_libllvm() == Path("/x/libLLVM.so.19.1")
        return
    with pytest.raises(InputError, match=expected):
        llvm.find_libllvm()


@pytest.mark.parametrize("exists", [True, False])
def test_library_that_is_named_is_taken_or_missed(exists, tmp_path, monkeypatch):
    path = tmp_path / "libLLVM-17.so"
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(path))
    if exists:
        path.write_bytes(b"")
        assert llvm.find_libllvm() == path
        return
    with pytest.raises(InputError, match=r"libLLVM-17\.so, which does not exist"):
        llvm.find_libllvm()
