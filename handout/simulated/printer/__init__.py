"""A printer and a flatbed scanner that exist only in the computer: for trying things out, and for tests.

What a page goes through is what a person's page goes through: the job that the queue was given is read (`rip`), printed
(`Inkjet`, `Measured`) and scanned (`Flatbed`), each with faults on demand.  The model of the inks is of the printer's
own; nothing that matches colours uses it.

    sheet = Inkjet(paper="cream", faults=["clogged"]).printed(page, 300)
    picture = Flatbed(noise=0.01, warp=1.0).scan(sheet, 300, np.random.default_rng(0))
"""

from handout.simulated.printer import rip
from handout.simulated.printer.faults import FAULTS
from handout.simulated.printer.inkjet import Inkjet
from handout.simulated.printer.measured import Measured
from handout.simulated.printer.press import Press
from handout.simulated.printer.stock import PAPERS
from handout.simulated.scanner import SETTINGS, Flatbed
from handout.simulated.sheet import Sheet

__all__ = ["FAULTS", "PAPERS", "SETTINGS", "Flatbed", "Inkjet", "Measured", "Press", "Sheet", "rip"]
