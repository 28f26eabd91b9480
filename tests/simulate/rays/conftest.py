"""Tests of the ray tracer search anew, since some change what a search leaves out."""

import pytest

from simulate.rays import chain_solver


@pytest.fixture(autouse=True)
def no_chains_kept(monkeypatch):
    monkeypatch.setattr(chain_solver, "_latest", {})
    monkeypatch.setattr(chain_solver, "LATEST", 0)
