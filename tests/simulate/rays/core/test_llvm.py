"""Which libLLVM is taken, and that an old one is refused before Dr.Jit can abort the process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scenes.files.errors import InputError
from simulate.rays.core import llvm

ROOT = Path(__file__).parents[4]


@pytest.fixture
def unnamed(monkeypatch):
    """No DRJIT_LIBLLVM_PATH; importing the ray tracer in another test sets it."""
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)


@pytest.fixture
def old(tmp_path) -> Path:
    """A file by the name of LLVM 15."""
    path = tmp_path / "libLLVM-15.so.1"
    path.write_bytes(b"")
    return path


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("libLLVM-15.so.1", 15),
        ("libLLVM-14.so", 14),
        ("libLLVM.so.19.1", 19),
        ("libLLVM.so.20.1", 20),
        ("libLLVM-19.so", 19),
        ("libLLVM-9.so.1", 9),
    ],
)
def test_version_is_read_from_the_name(name, version, tmp_path):
    assert llvm.llvm_version(tmp_path / name) == version


def test_version_is_read_from_the_name_a_link_leads_to(tmp_path, old):
    (tmp_path / "libLLVM.so").symlink_to(old)
    assert llvm.llvm_version(tmp_path / "libLLVM.so") == 15


def test_file_that_is_no_library_has_no_version(tmp_path):
    path = tmp_path / "libLLVM.so"
    path.write_bytes(b"not a library")
    assert llvm.llvm_version(path) is None


def test_library_whose_name_does_not_tell_is_asked(tmp_path, unnamed):
    """A copy under a bare name answers LLVMGetVersion as its name said."""
    good = llvm.find_libllvm().resolve()
    (tmp_path / "bare.so").hardlink_to(good) if good.stat().st_dev == tmp_path.stat().st_dev else pytest.skip(
        "libLLVM is on another file system than the temporary folder"
    )
    assert llvm.llvm_version(tmp_path / "bare.so") == llvm.llvm_version(good)


def run(*arguments, library):
    return subprocess.run(
        [sys.executable, *arguments],
        env=os.environ | {"DRJIT_LIBLLVM_PATH": str(library)},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


def test_old_library_is_refused_in_one_sentence(old):
    found = run("-m", "simulate.rays.core.llvm", library=old)
    assert found.returncode == 1
    assert found.stdout == ""
    assert len(found.stderr.splitlines()) == 1
    for word in (str(old), "LLVM 15", "16 or newer", "apt-get install"):
        assert word in found.stderr


def test_old_library_is_refused_before_drjit_is_imported(old):
    """With it, the first kernel would abort the process."""
    program = (
        "import sys\n"
        "from scenes.files.errors import InputError\n"
        "try:\n"
        "    import simulate.rays.tracer\n"
        "except InputError as error:\n"
        "    print('drjit' in sys.modules, error)\n"
    )
    found = run("-c", program, library=old)
    assert found.returncode == 0, found.stderr
    assert found.stdout.startswith(f"False DRJIT_LIBLLVM_PATH names {old}, LLVM 15")


def test_missing_library_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "libLLVM-19.so"))
    with pytest.raises(InputError, match=r"libLLVM-19\.so, which does not exist"):
        llvm.find_libllvm()


def test_library_that_is_named_is_taken(tmp_path, monkeypatch):
    path = tmp_path / "libLLVM-17.so"
    path.write_bytes(b"")
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(path))
    assert llvm.find_libllvm() == path


def test_machine_without_a_library_is_told_how_to_get_one(monkeypatch, unnamed):
    monkeypatch.setattr(llvm, "installed_libraries", lambda: [])
    with pytest.raises(InputError, match=r"needs libLLVM and this machine has none; install LLVM 16 or newer"):
        llvm.find_libllvm()


def test_machine_with_old_libraries_only_is_told_which_is_the_newest(monkeypatch, unnamed):
    libraries = [Path("/x/libLLVM-14.so.1"), Path("/x/libLLVM-15.so.1"), Path("/x/libLLVM-9.so.1")]
    monkeypatch.setattr(llvm, "installed_libraries", lambda: libraries)
    with pytest.raises(InputError, match=r"newest libLLVM here is /x/libLLVM-15\.so\.1 \(LLVM 15\), too old"):
        llvm.find_libllvm()


def test_newest_library_is_taken(monkeypatch, unnamed):
    libraries = [Path("/x/libLLVM-9.so.1"), Path("/x/libLLVM.so.19.1"), Path("/x/libLLVM-16.so.1")]
    monkeypatch.setattr(llvm, "installed_libraries", lambda: libraries)
    assert llvm.find_libllvm() == libraries[1]
