"""A dataset folder is checked without an error, whatever is wrong with it."""

from learn.evaluation.check import check


def test_check_of_a_good_folder_describes_it(tiny):
    found = check(str(tiny))
    assert found.valid and found.problems == [] and len(found.dataset.names) == 24
    assert found.leakage.distance.shape == found.leakage.ssim.shape == (5,)
    described = found.description()
    assert described["training / test"] == "19 / 5" and described["gateway looks along"] == "[0.0, 0.0, 1.0]"
    assert described["split"] == found.leakage.facts()


def test_check_of_no_folder_has_the_problem_and_nothing_else(tmp_path):
    found = check(tmp_path / "nowhere")
    assert not found.valid and "nowhere" in found.problems[0]
    assert found.dataset is None and found.leakage is None and found.description() == {}


def test_split_that_leaks_is_a_warning(tmp_path, write_folder):
    found = check(write_folder(tmp_path / "path", count=60))
    assert found.valid and found.leakage.leaks and found.warnings == [found.leakage.warning()]
