"""Work divided among threads: every item once, and errors are raised."""

from threading import get_ident

import numba
import pytest

from simulate.parallel.compiled import in_threads


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
