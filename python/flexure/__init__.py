"""Flexure: the nonlinear blocks inside systems, from input-output records.

See https://docs.rs/flexure for the methods; `flexure.regression` for static nonlinearities.
"""

import lazy_loader

# The names are in `__init__.pyi`. Each is imported at its first use: scikit-learn alone takes a second.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
