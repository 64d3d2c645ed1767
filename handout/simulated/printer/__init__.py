"""A printer that exists only in the computer: for trying things out, and for tests.

    press          what every simulated printer does with a page, whatever its inks
    inkjet         `Inkjet`: spectral halftones of four inks, and the papers; add a paper in its `PAPERS`
    faults         what can go wrong, on demand; add a fault in its `FAULTS`
    job_reader     the pages of a job, as the queue was given it
    pen            the person at the printer, who writes in the frame of a chart

A page goes through what a person's page goes through: its job is read, printed and scanned (`simulated.scanner`), each
with faults on demand.  The model of the inks is of the printer's own; nothing that matches colours uses it.

    sheet = Inkjet(paper="cream", faults=["clogged"]).printed(page, 300)
    picture = Flatbed(noise=0.01, warp=1.0).scan(sheet, 300, np.random.default_rng(0))
"""

from handout.simulated.printer import job_reader
from handout.simulated.printer.faults import FAULTS
from handout.simulated.printer.inkjet import PAPERS, Inkjet
from handout.simulated.printer.press import Press
from handout.simulated.scanner import SETTINGS, Flatbed
from handout.simulated.sheet import SimulatedSheet

__all__ = ["FAULTS", "PAPERS", "SETTINGS", "Flatbed", "Inkjet", "Press", "SimulatedSheet", "job_reader"]
