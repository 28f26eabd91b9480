"""A fit says what it is doing: in a pipe by a line for each tenth, in a terminal by bars that fill."""

import re

import pytest

from learn.training.fit_progress import FitProgress
from scenes.files import progress


def fit(report):
    for phase, most in (("score by distance", 4), ("covariance", 60)):
        for done in range(4):
            report(phase, done, most)


def test_a_pipe_gets_a_line_for_each_tenth(capsys, monkeypatch):
    monkeypatch.setattr(progress, "AFTER", 0.0)  # seconds between lines
    with FitProgress("fit to 7 spectra") as report:
        fit(report)
    out, err = capsys.readouterr()
    lines = [f"bisplat: fit to 7 spectra: score by distance: {done} of 4" for done in (1, 2, 3)]
    assert out == "" and err.splitlines() == lines


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
    last = {phase: line for line in lines for phase in ("score", "covariance") if f"7 spectra: {phase}" in line}
    assert "4/4" in last["score"] and "60/60" in last["covariance"]  # a bar is drawn again and again


@pytest.mark.usefixtures("terminal")
def test_phase_that_fails_is_not_shown_as_finished(capsys):
    with pytest.raises(KeyboardInterrupt), FitProgress("fit") as report:
        report("covariance", 3, 60)
        raise KeyboardInterrupt
    assert "60/60" not in capsys.readouterr().err
