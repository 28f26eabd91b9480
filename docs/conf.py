"""Sphinx builds the documentation from here: `make docs` shows it in the browser, `make docs-build` only builds it.

We chose Sphinx because the field's readers know it (Sionna RT, DiffeRT, gsplat, nerfstudio and viser use it), and
because it checks what it builds: a link to a name, page or heading that does not exist ends a strict build. Pages are
Markdown (MyST).
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "_extensions")]

project = "bisplat-wrf"
copyright = "the bisplat-wrf authors"
release = re.search(r'^version = "(.*)"$', (ROOT / "pyproject.toml").read_text(), re.M)[1]
version = release

extensions = [
    "myst_nb",  # pages in Markdown, and the notebook with its kept outputs
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",  # docstrings in Google's style
    "sphinx.ext.viewcode",
    "sphinx.ext.mathjax",
    "matplotlib.sphinxext.plot_directive",  # figures that are drawn when the site is built
    "sphinx_design",  # cards and grids
    "sphinx_copybutton",
    "sphinxcontrib.bibtex",
    "from_code",  # ours: tables made from the parser and the materials, and citations in docstrings
]
exclude_patterns = ["_build"]
smartquotes = False  # they would make one dash of the two of an option

html_theme = "furo"
html_title = f"bisplat-wrf {release}"
html_static_path = ["_static"]
html_theme_options = {"navigation_with_keys": True}

nb_execution_mode = "off"  # tests/docs/test_notebook.py runs it
myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
napoleon_numpy_docstring = False
napoleon_use_rtype = False

bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "plain"

copybutton_prompt_text = "$ "
plot_formats = [("png", 150)]
plot_html_show_formats = False
plot_html_show_source_link = False
plot_rcparams = {"font.size": 9, "figure.constrained_layout.use": True}
