"""Flexure: the nonlinear blocks inside systems, from input-output records.

`docs/theory` in the repository explains the methods. `flexure.regression` is for static nonlinearities.
"""

from importlib import import_module

import lazy_loader

# The names are in `__init__.pyi`. Each is imported at its first use: scikit-learn alone takes a second.
_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    if name[:1].isupper() and name not in __all__:
        # The classes that `systems` makes of structures without a class of their own.
        return getattr(import_module("flexure.systems"), name)
    return _attribute(name)
