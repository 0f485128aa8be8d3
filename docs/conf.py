"""Sphinx's settings for the book: `make book` builds docs/ into out/book, which opens from disk.

Nothing on a page comes from the network: formulas are MathML, fonts are the system's, the search index is a file.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import gonio

sys.path.insert(0, str(Path(__file__).parent))

project = "Gonio"
author = "The Gonio authors"
project_copyright = "2026, The Gonio authors"
version = release = gonio.__version__

extensions = ["myst_parser", "sphinx_design", "book.extension"]
# the copies of these pages in the book are made from the code: docs/reference
exclude_patterns = ["models", "reference/live", "reference/strips", "images", "report-cards/programs"]
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "attrs_inline"]
myst_heading_anchors = 4
myst_dmath_allow_digits = False  # "$3" is no formula
suppress_warnings = ["myst.header"]  # a page that is shared with `gonio explain` may begin below its title

html_theme = "furo"
html_title = "Gonio"
html_static_path = ["book/static"]
html_css_files = ["book.css"]
html_extra_path = [] if os.environ.get("GONIO_BOOK") == "quick" else ["reference/live", "reference/strips"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False  # summaries are fetched, which browsers refuse to pages opened from disk
html_theme_options = {"navigation_with_keys": True}
smartquotes = False  # "--option" would become a dash
highlight_language = "text"
pygments_style = "friendly"
pygments_dark_style = "monokai"
