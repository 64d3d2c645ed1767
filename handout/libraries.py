"""Libraries that take long to load, each loaded once something of it is used: most verbs do without.

For whoever reads and checks a file ``from handout.libraries import cv2`` at its head is ``import cv2``.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import cv2 as cv2
    from scipy import interpolate as interpolate
    from scipy import ndimage as ndimage
    from scipy import optimize as optimize
    from scipy import sparse as sparse
    from scipy import spatial as spatial
    from scipy.linalg import lapack as lapack
    from scipy.sparse import csgraph as csgraph
else:
    _LAPACK = "scipy.linalg.lapack"

    @cache
    def _load(name: str) -> Any:
        """A module; of LAPACK the bare extension: all of `scipy.linalg` takes a tenth of the time of a sentence."""
        if name == _LAPACK:
            import scipy

            spec = PathFinder.find_spec("_flapack", [f"{folder}/linalg" for folder in scipy.__path__])
            if spec is not None and spec.loader is not None:
                spec.loader.exec_module(module := module_from_spec(spec))
                return module
        return import_module(name)

    class _Library:
        """A module that is loaded by the first of its names that is asked for."""

        def __init__(self, module: str) -> None:
            self._module = module

        def __getattr__(self, name: str) -> Any:
            # kept here, so that it is asked for once
            value = self.__dict__[name] = getattr(_load(self._module), name)
            return value

    cv2 = _Library("cv2")
    interpolate, ndimage, optimize = map(_Library, ("scipy.interpolate", "scipy.ndimage", "scipy.optimize"))
    sparse, csgraph, spatial = map(_Library, ("scipy.sparse", "scipy.sparse.csgraph", "scipy.spatial"))
    lapack = _Library(_LAPACK)
