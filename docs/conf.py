"""The documentation as a site: ``sphinx-build docs site``. It loads nothing from a network."""

import importlib.metadata
import re

from latex2mathml.converter import convert

project = "touchatlas"
author = "the authors of touchatlas"
release = importlib.metadata.version("touchatlas")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
# A page that nobody has put into a list yet is found by the search.
suppress_warnings = ["toc.not_included"]
html_theme = "furo"
html_title = "touchatlas"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_math_renderer = "mathml"
autodoc_default_options = {"members": True, "imported-members": True, "show-inheritance": True}
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_rtype = False
# The first line of a docstring is the quantity, and shapes stand where others have types.
napoleon_preprocess_types = False


def _mathml(block: bool):
    """A visitor that writes a formula as MathML, which browsers draw themselves."""

    def visit(writer, node) -> None:
        from docutils.nodes import SkipNode

        formula = convert(node.astext(), display="block" if block else "inline")
        writer.body.append(f'<div class="formula">{formula}</div>' if block else formula)
        raise SkipNode

    return visit


def _as_words(_app, _name, source: list[str]) -> None:
    """Links to files that are no pages are left as their words."""
    outside = r"\[([^]]*)\]\(((?:\.\./)+(?!docs/)[^)]*|[^)]*\.(?:csv|py))\)"
    source[0] = re.sub(outside, r"\1", source[0])


def setup(app) -> None:
    """Take the two hooks above."""
    app.add_html_math_renderer("mathml", (_mathml(False), None), (_mathml(True), None))
    app.connect("source-read", _as_words)
