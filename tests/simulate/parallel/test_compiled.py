"""Kernels compile where nothing can be kept, and work is divided among threads."""

from threading import get_ident

import numba
import pytest

from simulate.parallel import compiled as module
from simulate.parallel.compiled import compiled, in_threads


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


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("count", [0, 1, 4, 5, 23])
def test_every_item_is_worked_on_once(count, threads, monkeypatch):
    monkeypatch.setattr(numba, "get_num_threads", lambda: threads)
    done, workers = [], set()

    def work(some: slice) -> None:
        workers.add(get_ident())
        done.extend(range(count)[some])

    in_threads(work, count, 4)
    assert sorted(done) == list(range(count))
    assert (workers <= {get_ident()}) == (threads == 1 or count <= 4)


def test_errors_are_raised(monkeypatch):
    monkeypatch.setattr(numba, "get_num_threads", lambda: 2)
    with pytest.raises(ZeroDivisionError):
        in_threads(lambda some: 1 / (some.start - 4), 9, 4)
