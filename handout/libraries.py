"""Libraries that take long to load, each loaded once something of it is used: most verbs do without.

For whoever reads and checks a file ``from handout.libraries import cv2`` at its head is ``import cv2``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import cv2 as cv2
    from scipy import interpolate as interpolate
    from scipy import ndimage as ndimage
    from scipy import optimize as optimize
    from scipy import sparse as sparse
    from scipy import spatial as spatial
    from scipy.sparse import csgraph as csgraph
else:

    class _Library:
        """A module that is loaded by the first of its names that is asked for."""

        def __init__(self, module: str) -> None:
            self._module = module

        def __getattr__(self, name: str) -> Any:
            # kept here, so that it is asked for once
            value = self.__dict__[name] = getattr(import_module(self._module), name)
            return value

    cv2 = _Library("cv2")
    interpolate, ndimage, optimize = map(_Library, ("scipy.interpolate", "scipy.ndimage", "scipy.optimize"))
    sparse, csgraph, spatial = map(_Library, ("scipy.sparse", "scipy.sparse.csgraph", "scipy.spatial"))
