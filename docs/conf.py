"""Settings of the documentation: Sphinx, pages in Markdown (MyST), no network needed to read it."""

import sys
from pathlib import Path

import geoimp_drake

sys.path.insert(0, str(Path(__file__).resolve().parent / "_extensions"))

project = "geoimp_drake"
author = "The geoimp_drake authors"
version = release = geoimp_drake.__version__

extensions = [
    "library_docstrings",  # ours
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "library_pages",  # ours
    "mathml",  # ours
    "myst_parser",
]
exclude_patterns = ["_build"]

# References from the pages and from the equation index are of the kind py:obj, and must resolve.
# Types in signatures are not looked up: Drake's and numpy's would take a network.
nitpicky = True
nitpick_ignore_regex = [(r"py:(?!obj).*", r".*"), (r"py:obj", r"(?!geoimp_drake\.).*")]

highlight_language = "text"  # of what is only indented: formulas, diagrams
default_role = "literal"  # docstrings set code in single backticks
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
napoleon_custom_sections = ["Ports", "Fields"]
napoleon_numpy_docstring = False
napoleon_use_ivar = True

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"geoimp_drake {release}"
templates_path = ["_templates"]
_sidebar = ("brand", "search", "scroll-start", "navigation", "scroll-end")
html_sidebars = {"**": [*(f"sidebar/{part}.html" for part in _sidebar), "versions.html"]}
html_static_path = ["_static"]
html_css_files = ["tables.css"]
html_math_renderer = "mathml"
html_show_sphinx = False
