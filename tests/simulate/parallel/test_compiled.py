"""Kernels compile where nothing can be kept, as in a read-only installation without a home folder."""

import numba
import pytest

from simulate.parallel import compiled as module
from simulate.parallel.compiled import compiled


@pytest.fixture
def nothing_kept(monkeypatch):
    """Numba finds no folder."""
    whole = numba.njit

    def njit(*arguments, cache=False, **options):
        if cache:
            raise RuntimeError("cannot cache function 'kernel': no locator available for file 'kernel.py'")
        return whole(*arguments, **options)

    monkeypatch.setattr(numba, "njit", njit)
    module._say_that_nothing_is_kept.cache_clear()


def test_kernels_work_and_one_sentence_says_what_to_do(nothing_kept, capsys):
    plain = compiled(lambda x: x + 1)
    fast = compiled(fastmath=True)(lambda x: 2 * x)
    assert (plain(1), fast(2)) == (2, 4)
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith("bisplat: found no folder to keep compiled functions in") and "NUMBA_CACHE_DIR=" in said


def test_machine_code_is_kept_otherwise(capsys):
    @compiled
    def kernel(x):
        return x + 1

    assert kernel(1) == 2 and kernel._cache is not None
    assert type(kernel._cache).__name__ == "FunctionCache" and capsys.readouterr().err == ""
