"""Settings of the site that tools/make_docs.py makes with Sphinx, and equations as MathML for it.

Nothing of the site is fetched while it is read: the theme brings its files, browsers draw MathML themselves, and
make_docs.py puts a font for it into static/.
"""

import re

from docutils.nodes import SkipNode, math, math_block
from math_core import LatexToMathML
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

project = "sbs_sim"
copyright = "the sbs_sim maintainers"
root_doc = "docs/index"
exclude_patterns = ["docs/requirements.txt"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]

html_theme = "furo"
html_title = "sbs_sim"
html_static_path = ["static"]
html_css_files = ["equations.css"]
html_copy_source = False

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4  # as GitHub makes them

autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "none"  # the docstrings say more: shapes, units, frames
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
napoleon_use_admonition_for_examples = False
smartquotes = False
default_role = "code"  # docstrings write names in single backquotes
suppress_warnings = ["ref.python"]  # types are named in short, and two modules may have the same name

LATEX = LatexToMathML()
TAG = re.compile(r"\\tag\{([^{}]+)\}")


def inline_equation(self: HTML5Translator, node: math) -> None:
    """Write an equation within a line."""
    self.body.append(LATEX.convert_with_local_state(node.astext(), displaystyle=False))
    raise SkipNode


def displayed_equation(self: HTML5Translator, node: math_block) -> None:
    """Write an equation that stands alone, with its number at the right and as its anchor."""
    text = node.astext()
    number = TAG.search(text)
    anchor, label = (f' id="equation-{number[1]}"', f"<span>({number[1]})</span>") if number else ("", "")
    equation = LATEX.convert_with_local_state(TAG.sub("", text), displaystyle=True)
    self.body.append(f'<div class="equation"{anchor}>{equation}{label}</div>')
    raise SkipNode


def plain(app: Sphinx, what: str, name: str, item: object, options: object, lines: list[str]) -> None:
    """Let bars and final underscores of docstrings, |pole| and x_, be what they are."""
    for i, line in enumerate(lines):
        parts = re.split(r"(`[^`]*`)", line)
        lines[i] = "".join(part if part[:1] == "`" else re.sub(r"(\||(?<=\w)_(?!\w))", r"\\\1", part) for part in parts)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register what is done here."""
    app.connect("autodoc-process-docstring", plain, priority=400)  # before napoleon, whose markup must stay
    app.add_html_math_renderer("mathml", (inline_equation, None), (displayed_equation, None))
    app.config["html_math_renderer"] = "mathml"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
