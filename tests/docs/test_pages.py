"""Every command and every snippet on every page runs, from top to bottom, at a small size."""

import contextlib
import io

import matplotlib
import pytest

from tests.docs.pages import GENERATED, PAGES, blocks
from tests.docs.small_size import use_small_functions

RUN = [page for page in PAGES if page not in GENERATED and any(not block.reason for block in blocks(page))]


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN)
def test_a_reader_can_do_what_the_page_says(page, folder, shell, monkeypatch, undo_small_sizes):
    monkeypatch.chdir(folder)
    matplotlib.use("agg")
    names: dict = {"__name__": "__main__"}
    for block in blocks(page):
        if block.reason:
            continue
        if block.language == "bash":
            shell("\n".join(block.commands()))
            continue
        if block.file:
            (folder / block.file).write_text(block.text)
            continue
        use_small_functions()
        program = compile("\n" * (block.line - 1) + block.text, str(PAGES[page]), "exec")
        with contextlib.redirect_stdout(io.StringIO()):
            exec(program, names)


def test_commands_that_are_not_run_say_why():
    unrun = {f"{page}:{block.line}": block.reason for page in PAGES for block in blocks(page) if block.reason}
    assert all(len(reason) > 10 for reason in unrun.values()), unrun


@pytest.mark.parametrize("page", sorted(set(PAGES) - GENERATED))
def test_blocks_of_code_name_their_language(page):
    fences = [line for line in PAGES[page].read_text().splitlines() if line.startswith("```")]
    assert "```" not in fences[::2], "a block without a language is neither run nor coloured"
