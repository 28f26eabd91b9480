"""A fit says what it is doing: in a pipe by a line for each phase, in a terminal by bars that fill."""

import re

import pytest

from learn.training.fit_progress import FitProgress


def fit(report):
    for phase, most in (("score by distance", 4), ("covariance", 60)):
        for done in range(4):
            report(phase, done, most)


def test_each_phase_is_one_line_in_a_pipe(capsys):
    with FitProgress("fit to 7 spectra") as report:
        fit(report)
    out, err = capsys.readouterr()
    assert (out, err) == ("", "bisplat: fit to 7 spectra: score by distance\nbisplat: fit to 7 spectra: covariance\n")


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")


@pytest.mark.usefixtures("terminal")
def test_each_phase_is_a_bar_in_a_terminal_and_a_finished_one_is_full(capsys):
    with FitProgress("fit to 7 spectra") as report:
        fit(report)
    lines = re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", capsys.readouterr().err).replace("\r", "").splitlines()
    assert lines[0] == "bisplat: fit to 7 spectra"
    last = {line.split()[0]: line for line in lines}  # a bar is drawn again and again
    assert "4/4" in last["score"] and "60/60" in last["covariance"]


@pytest.mark.usefixtures("terminal")
def test_phase_that_fails_is_not_shown_as_finished(capsys):
    with pytest.raises(KeyboardInterrupt), FitProgress("fit") as report:
        report("covariance", 3, 60)
        raise KeyboardInterrupt
    assert "60/60" not in capsys.readouterr().err
