"""A folder of another program's predictions joins a comparison, and what is wrong with it is one sentence."""

import numpy as np
import pytest
from PIL import Image

import bisplat
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import read_dataset


@pytest.fixture
def truth(tiny):
    """Names of the test part of the random split, and its spectra."""
    dataset = read_dataset(tiny)
    test = bisplat.split(dataset, "random", seed=0).test
    return [dataset.names[index] for index in test], dataset.spectra[test]


@pytest.fixture
def theirs(tmp_path, truth):
    """A folder of pictures that are darker than the truth, and a file that does not belong to them."""
    folder = tmp_path / "theirs"
    (folder / "spectrum").mkdir(parents=True)
    for name, spectrum in zip(*truth, strict=True):
        Image.fromarray((255 * 0.8 * spectrum).astype(np.uint8)).save(folder / "spectrum" / f"{name}.png")
    (folder / "spectrum" / "99999.png").write_text("no picture")
    (folder / "notes.txt").write_text("darker by a fifth")
    return folder


def compared(tiny, tmp_path, folder, **options):
    models = [f"theirs={folder}"]
    return bisplat.compare(tiny, models, split="random", output=tmp_path / "out", **options)


def test_pictures_get_the_scores_of_hand_and_of_one_seed(tiny, tmp_path, theirs, truth):
    comparison = compared(tiny, tmp_path, theirs, seeds=2)
    (row,) = [row for row in comparison if row["label"] == "theirs"]
    read = [np.asarray(Image.open(theirs / "spectrum" / f"{name}.png")) / np.float32(255) for name in truth[0]]
    errors = np.abs(np.stack(read) - truth[1]).mean(axis=(1, 2))
    assert row["mae_mean"] == pytest.approx(errors.mean(), rel=1e-6) and row["seconds"] is None
    np.testing.assert_allclose(comparison.each["theirs"]["mae"], errors, atol=1e-6)
    assert comparison.settings.data_sha256 == read_dataset(tiny).fingerprint


def test_an_array_gets_the_scores_of_pictures_and_only_changed_ones_are_scored_again(tiny, tmp_path, theirs, truth):
    before = compared(tiny, tmp_path, theirs).rows
    (theirs / "notes.txt").write_text("another note")
    assert compared(tiny, tmp_path, theirs).rows == before
    np.save(theirs / "spectra.npy", truth[1])
    perfect = compared(tiny, tmp_path, theirs, tested=None)
    assert [row["label"] for row in perfect] == [row["label"] for row in before]
    assert perfect.table()[0]["label"] == "theirs" and perfect.table()[0]["ssim_median"] == pytest.approx(1)


@pytest.mark.parametrize("fault", ["missing", "shape", "nan", "levels", "link", "size", "nothing", "nowhere"])
def test_wrong_predictions_are_one_sentence_and_leave_no_row(tiny, tmp_path, theirs, truth, fault):
    names, spectra = truth
    first = theirs / "spectrum" / f"{names[1]}.png"
    said = {
        "missing": f"{first.name}: expected a prediction",
        "shape": rf"spectra.npy.*: expected spectra \[{len(names)}, 90, 360\]",
        "nan": "spectra.npy, row 1 .*: expected finite numbers",
        "levels": "spectra.npy, row 0 .*: expected .* to 255",
        "link": f"{first.name}: expected a file in the folder",
        "size": f"{first.name}: expected 360 × 90 pixels",
        "nothing": "theirs: expected .*, found neither",
        "nowhere": "theirs: expected a folder",
    }[fault]
    if fault in ("shape", "nan", "levels"):
        wrong = {"shape": spectra[1:], "nan": spectra.copy(), "levels": 255 * spectra}[fault]
        wrong[1, 2, 3] = np.nan if fault == "nan" else wrong[1, 2, 3]
        np.save(theirs / "spectra.npy", wrong)
    elif fault == "nothing":
        (theirs / "spectrum").rename(theirs / "pictures")
    elif fault == "nowhere":
        theirs.rename(tmp_path / "away")
    else:
        first.rename(tmp_path / "away.png")
        if fault == "link":
            first.symlink_to(tmp_path / "away.png")
        elif fault == "size":
            Image.fromarray(np.zeros((90, 180), np.uint8)).save(first)
    with pytest.raises(InputError, match=said):
        compared(tiny, tmp_path, theirs)
    assert not (tmp_path / "out" / "results.jsonl").exists()
