"""The book: `sphinx-build -W docs OUT` in the folder `python`, with Flexure installed."""

import flexure

project = "Flexure"
version = release = flexure.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath"]
# The notebooks are stored with their outputs, and run in the tests.
nb_execution_mode = "off"
autodoc_default_options = {
    "members": True,
    # What the private base class has, but not what scikit-learn and Python document themselves.
    "inherited-members": "BaseEstimator,RegressorMixin,tuple,object",
    "exclude-members": "set_fit_request,set_predict_request,set_score_request,get_metadata_routing",
    "member-order": "bysource",
}
autodoc_typehints = "none"
# Names between single backticks are links where they are known.
default_role = "py:obj"
napoleon_google_docstring = False
napoleon_use_ivar = True
html_theme = "alabaster"
html_theme_options = {"description": "The nonlinear blocks inside systems, from input-output records", "page_width": "1100px"}
html_static_path = ["style"]
html_css_files = ["lines.css"]
exclude_patterns = ["requirements.txt"]
