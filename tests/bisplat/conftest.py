"""What tests of the commands share."""

import sys

import pytest

from bisplat.__main__ import main


@pytest.fixture
def command(monkeypatch, capsys):
    """Function: runs ``bisplat`` with these arguments -> exit status, stdout, stderr, without a traceback in them."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["bisplat", *map(str, arguments)])
        capsys.readouterr()
        status = 0
        try:
            main()
        except SystemExit as leaving:
            status = leaving.code
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return status, out, err

    return run
