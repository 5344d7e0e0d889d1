"""The site: `docs/build`."""

import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "_extensions"))

project = "Flexure"
author = "the authors of Flexure"
extensions = ["myst_parser", "mathml", "flexure_pages"]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["examples/**", "_extensions/**", "style/**", "requirements.txt"]
nitpicky = True
numfig = False
math_numfig = False
highlight_language = "text"

# The reference of Python is taken from the installed package; `docs/build --without-python` leaves it out.
if os.environ.get("FLEXURE_DOCS_WITHOUT_PYTHON"):
    exclude_patterns.append("python/**")
    # Links into what is left out.
    suppress_warnings = ["toc.excluded", "myst.xref_missing"]
else:
    extensions += ["sphinx.ext.autodoc", "sphinx.ext.napoleon"]
    autodoc_default_options = {
        "members": True,
        # The members of the private base class, but not those that scikit-learn and Python document themselves.
        "inherited-members": "BaseEstimator,RegressorMixin,tuple,object",
        "exclude-members": "set_fit_request,set_partial_fit_request,set_predict_request,set_score_request,get_metadata_routing",
        "member-order": "bysource",
    }
    autodoc_typehints = "none"
    # Names between single backticks are links where they are known.
    default_role = "py:obj"
    napoleon_google_docstring = False
    napoleon_use_ivar = True
    nitpick_ignore_regex = [("py:.*", ".*")]

html_theme = "furo"
html_title = "Flexure"
html_math_renderer = "mathml"
html_static_path = ["style"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1f5f99", "color-brand-content": "#1f5f99"},
    "dark_css_variables": {"color-brand-primary": "#7db5e8", "color-brand-content": "#7db5e8"},
}
