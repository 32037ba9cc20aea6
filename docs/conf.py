"""The documentation as a site: `make docs`. Its pages are the files of the repository."""

from pathlib import Path

project = "quarc-ref"
html_title = "quarc-ref"
html_theme = "furo"
html_copy_source = False
html_show_sphinx = False
root_doc = "docs/index"
extensions = ["autoapi.extension", "myst_parser", "sphinx.ext.napoleon"]
include_patterns = [
    "*.md",
    "benchmarks/*.md",
    "conformance/**.md",
    "core/**.md",
    "decoders/**.md",
    "docs/**",
    "player/**.md",
    "requirements/*.md",
]
exclude_patterns = ["**/node_modules", "**/target", "docs/templates"]

# Anchors of headings are those of the repository's host.
myst_heading_anchors = 4
myst_links_external_new_tab = False

# The API is read from the docstrings without importing the package: no torch is needed here.
autoapi_dirs = [str(Path(__file__).parent.parent / "quarc_ref")]
autoapi_root = "docs/api"
autoapi_options = ["members", "show-module-summary"]
autoapi_own_page_level = "module"
autoapi_template_dir = str(Path(__file__).parent / "templates")
autoapi_add_toctree_entry = False  # docs/index.md has it
napoleon_use_ivar = True
# Warnings about names that two modules define, imports of constants, markup in docstrings, and
# pages without a toctree, such as most pages of the API.
suppress_warnings = [
    "ref.python",
    "autoapi.python_import_resolution",
    "docutils",
    "toc.not_included",
]
autoapi_keep_files = False
autoapi_member_order = "bysource"
