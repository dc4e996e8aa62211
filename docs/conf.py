"""Sphinx configuration. Pages load local files only and need no network."""

import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(REPOSITORY), str(REPOSITORY / "docs")]

import smarticles  # noqa: E402  (from this repository)

project = "Smarticles"
author = "The smarticle simulator's authors"
copyright = author  # noqa: A001  (Sphinx's name)
version = release = smarticles.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "made"]
exclude_patterns = ["made"]
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
# Browsers render MathML themselves; MathJax would be a large script from another server.
html_math_renderer = "mathml"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_attr_annotations = False  # docstrings of attributes contain types and shapes
napoleon_custom_sections = [("Source", "notes_style"), ("Sources", "notes_style")]

html_theme = "furo"
html_title = f"Smarticles {release}"
html_static_path = ["site"]
html_css_files = ["site.css"]
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False
pygments_style = "friendly"
