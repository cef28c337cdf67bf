"""Formulas as MathML, which browsers show without scripts and without a network."""

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging

_log = logging.getLogger(__name__)


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the renderer `mathml`."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _inline(visitor: Any, node: nodes.math) -> None:
    visitor.body.append(_mathml(node, block=False))
    raise nodes.SkipNode


def _block(visitor: Any, node: nodes.math_block) -> None:
    visitor.body.append(_mathml(node, block=True))
    raise nodes.SkipNode


def _mathml(node: nodes.Element, *, block: bool) -> str:
    html = str(convert(node.astext(), display="block" if block else "inline"))
    if unknown := re.findall(r"\\\w+|&amp;", html):  # the converter passes them on
        _log.warning("%s in %r cannot be set", unknown, node.astext(), location=node)
    return html
