"""Sphinx settings of the documentation site; `python -m docs.build` runs it."""

project = "himpc-lab"
author = "the himpc-lab maintainers"
copyright = "MIT licence"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "docs.sphinx_parts"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]

html_theme = "furo"
html_title = "himpc-lab"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_favicon = "_static/icon.svg"
html_css_files = ["site.css"]
html_js_files = ["film.js", "figures.js"]
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False

myst_enable_extensions = ["dollarmath", "fieldlist"]
myst_heading_anchors = 3
myst_all_links_external = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_use_type_comments = False  # the code has no type comments
napoleon_use_ivar = True
napoleon_use_rtype = False
# Several classes have attributes or signatures with the same name; no page refers to such a name alone.
suppress_warnings = ["ref.python"]
