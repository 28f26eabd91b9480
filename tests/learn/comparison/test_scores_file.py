"""Scores of each test spectrum: written, read, and refused where the file is damaged."""

import numpy as np
import pytest
from learn.comparison.experiment import read_scores, write_scores

from learn.data.metrics import Scores
from scenes.files.errors import InputError
from tests import corpus

HEADER = "name,ssim,psnr_db,mae,aoa_error_deg\n"

DAMAGED = {
    **corpus.ANY_FILE,
    "nothing": (corpus.content(""), "line 1: expected the header"),
    "other columns": (corpus.content("name,ssim\n00001,1\n"), "found 'name,ssim'"),
    "no rows": (corpus.content(HEADER), "found none"),
    "empty line": (corpus.content(f"{HEADER}00001,1,2,3,4\n\n"), "line 3"),
    "word": (corpus.content(f"{HEADER}00001,1,2,3,x\n"), "found '00001,1,2,3,x'"),
    "fewer columns": (corpus.content(f"{HEADER}00001,1,2\n"), "line 2"),
    "no number": (corpus.content(f"{HEADER}00001,1,2,3,nan\n"), "finite numbers"),
    "UTF-16": (corpus.content(HEADER.encode("utf-16")), "UTF-8"),
}


def test_scores_are_read_as_written(tmp_path):
    values = np.random.default_rng(0).random((4, 3))
    write_scores(tmp_path / "a.csv", ["1", "2", "3"], Scores(*values))
    found = read_scores(tmp_path / "a.csv")
    assert list(found) == ["ssim", "psnr_db", "mae", "aoa_error_deg"]
    np.testing.assert_allclose(list(found.values()), values, atol=1e-6)


@pytest.mark.parametrize("case", DAMAGED)
def test_damaged_files(case, tmp_path):
    make, word = DAMAGED[case]
    make(tmp_path / "a.csv")
    with pytest.raises(InputError) as error:
        read_scores(tmp_path / "a.csv")
    assert word in str(error.value) and "a.csv" in str(error.value) and str(error.value).isprintable()
