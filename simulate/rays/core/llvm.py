"""Find the libLLVM with which Dr.Jit's CPU backend compiles, before Dr.Jit is imported.

Dr.Jit loads libLLVM at run time. With LLVM older than 16 it raises no error. Instead the code generator aborts the
process ("Cannot select: fmaximum"), which no ``try`` can catch. So an old library is refused here, with a message.

This module needs only the standard library, because set-up calls ``python -m simulate.rays.core.llvm --install``.
"""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from scenes.files.errors import InputError, printable

OLDEST_LLVM = 16
DEBIAN_PACKAGES = ("libllvm19", "libllvm20", "libllvm18", "libllvm17", "libllvm16")
FIX = (
    f"install LLVM {OLDEST_LLVM} or newer (Debian and Ubuntu, as root: apt-get install libllvm19; "
    "anyone: make setup, which unpacks it into .venv) or name one in DRJIT_LIBLLVM_PATH"
)


def llvm_version(library: Path) -> int | None:
    """Major version of a libLLVM, from its resolved file name, such as libLLVM-15.so.1 or libLLVM.so.19.1.

    If the name has no version, the library is loaded and ``LLVMGetVersion`` called, which exists since LLVM 16.
    """
    for name in (library.name, library.resolve().name):
        found = re.search(r"libLLVM(?:-|\.so\.)(\d+)", name)
        if found:
            return int(found.group(1))
    major = ctypes.c_uint(0)
    try:
        ctypes.CDLL(str(library)).LLVMGetVersion(ctypes.byref(major), None, None)
    except (OSError, AttributeError):
        return None
    return major.value


def installed_libraries() -> list[Path]:
    """Every libLLVM on this machine that our set-up unpacked, that the loader knows, or that is in a usual folder."""
    found = list(unpacked_folder().rglob("libLLVM*.so*"))
    ldconfig = shutil.which("ldconfig") or "/sbin/ldconfig"
    if os.path.exists(ldconfig):
        listing = subprocess.run([ldconfig, "-p"], capture_output=True, text=True, check=False).stdout
        found += [Path(path) for path in re.findall(r"=> (\S*libLLVM[-.]\S*)", listing)]
    for pattern in ("lib/*/libLLVM*.so*", "lib/llvm-*/lib/libLLVM*.so*", "local/lib/libLLVM*.so*"):
        found += Path("/usr").glob(pattern)
    return [path for path in dict.fromkeys(found) if path.exists()]


def unpacked_folder() -> Path:
    """The folder in the virtual environment where set-up unpacks Debian's package if it may not install it."""
    return Path(sys.prefix) / "lib" / "llvm"


def find_libllvm() -> Path:
    """The libLLVM to use: that of ``DRJIT_LIBLLVM_PATH`` if it is set, otherwise the newest on this machine."""
    named = os.environ.get("DRJIT_LIBLLVM_PATH")
    if named:
        path = Path(named)
        if not path.exists():
            raise InputError(f"DRJIT_LIBLLVM_PATH names {named}, which does not exist; {FIX}")
        version = llvm_version(path)
        if version is None or version < OLDEST_LLVM:
            raise InputError(f"DRJIT_LIBLLVM_PATH names {named}, LLVM {version or 'older than 16'}; {FIX}")
        return path
    versions = {path: llvm_version(path) or 0 for path in installed_libraries()}
    if not versions:
        raise InputError(f"the ray tracer needs libLLVM and this machine has none; {FIX}")
    newest = max(versions, key=lambda path: versions[path])
    if versions[newest] < OLDEST_LLVM:
        raise InputError(f"the newest libLLVM here is {newest} (LLVM {versions[newest]}), too old; {FIX}")
    return newest


def use_libllvm() -> None:
    """Point Dr.Jit to a suitable libLLVM. Call this before the first import of drjit, mitsuba or sionna.rt."""
    path = find_libllvm()
    if path.is_relative_to(unpacked_folder()):
        # Debian's library names its dependencies by soname. Once they are loaded, the loader need not search for them.
        for dependency in sorted(unpacked_folder().rglob("lib*.so*")):
            if not dependency.name.startswith("libLLVM"):
                ctypes.CDLL(str(dependency), mode=ctypes.RTLD_GLOBAL)
    os.environ["DRJIT_LIBLLVM_PATH"] = str(path)


def install_libllvm() -> None:
    """Install Debian's libLLVM as root, or else unpack it into the virtual environment."""
    apt = shutil.which("apt-get")
    if apt is None:
        raise InputError(f"this machine has no apt-get to install libLLVM; {FIX}")
    if os.geteuid() == 0:
        subprocess.run([apt, "update", "-qq"], check=False)
        for package in DEBIAN_PACKAGES:
            if subprocess.run([apt, "install", "-y", "-qq", package], check=False).returncode == 0:
                return
    for package in DEBIAN_PACKAGES:
        if _unpack([package, "libz3-4", "libedit2", "libbsd0", "libmd0"]):
            return
    raise InputError(f"could not get libLLVM from this machine's package index; {FIX}")


def _unpack(packages: list[str]) -> bool:
    """Download Debian packages and unpack their libraries without installing them. The first one must succeed."""
    with tempfile.TemporaryDirectory() as folder:
        for package in packages:
            got = subprocess.run(["apt-get", "download", "-qq", package], cwd=folder, check=False)
            if got.returncode != 0 and package == packages[0]:
                return False
        for archive in Path(folder).glob("*.deb"):
            subprocess.run(["dpkg-deb", "-x", str(archive), f"{folder}/root"], check=True)
        unpacked_folder().mkdir(parents=True, exist_ok=True)
        for library in Path(folder, "root").rglob("lib*.so*"):
            if not library.is_symlink() or library.resolve().exists():
                shutil.copy2(library, unpacked_folder() / library.name)
    return True


def main() -> int:
    """``python -m simulate.rays.core.llvm [--install]`` prints the libLLVM in use, or installs one."""
    try:
        try:
            path = find_libllvm()
        except InputError:
            if "--install" not in sys.argv[1:]:
                raise
            install_libllvm()
            path = find_libllvm()
    except InputError as error:
        print(printable(f"bisplat: {error}"), file=sys.stderr)
        return 1
    print(f"libLLVM {llvm_version(path)}: {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
