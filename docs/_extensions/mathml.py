"""Equations as MathML, which browsers show without scripts and fonts: made at build by latex2mathml."""

import re

from latex2mathml.converter import convert
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

logger = logging.getLogger(__name__)
# What latex2mathml leaves of commands and alignments that it does not know.
NOT_CONVERTED = re.compile(r"<m[io]>(\\[^<]*|&)</m[io]>|\\[a-zA-Z]+")


def mathml(node, display):
    text = node.astext().strip()
    try:
        result = convert(text, display=display)
    except Exception as error:
        logger.warning("equation not converted (%s): %s", error, text, location=node)
        return ""
    if NOT_CONVERTED.search(result):
        logger.warning("equation has something that latex2mathml does not know: %s", text, location=node)
    return result


def inline(translator, node):
    translator.body.append(mathml(node, "inline"))
    raise_skip()


def block(translator, node):
    translator.body.append(translator.starttag(node, "div", CLASS="equation"))
    translator.body.append(mathml(node, "block"))
    if node["number"]:
        number = get_node_equation_number(translator, node)
        translator.body.append(f'<span class="equation-number">({number})')
        translator.add_permalink_ref(node, "Link to this equation")
        translator.body.append("</span>")
    translator.body.append("</div>\n")
    raise_skip()


def raise_skip():
    from docutils.nodes import SkipNode

    raise SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
