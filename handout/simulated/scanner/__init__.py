"""A simulated flatbed scanner: a sheet on the glass, lamp, optics, dust, sensor and tone curve.

flatbed      all settings, within bounds, with those for handwriting; the tone curve
placement    where the sheet lies and how it bends; dust on the glass
optics       lamp, blur and noise, the same for all sheets
printed      the picture of a sheet from the simulated printer
"""

from handout.simulated.scanner.flatbed import SETTINGS
from handout.simulated.scanner.printed import Flatbed

__all__ = ["SETTINGS", "Flatbed"]
