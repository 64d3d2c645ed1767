"""From timed strokes to a machine: plan a drawing, open a port, run the plan; or write it as a plotter's program.

A drawing becomes a `Plan`, the plan becomes commands in the dialect of the machine, and these go through a `Controller`
with the dialect's own flow control to a port.  In that order:

    planning/       what plans: a drawing → a `Plan`, without a machine; `planning.planner` has the steps, and is where
                    the time of every stroke is decided
    bed.py          where a page lies on the machine: the only place that turns page into machine coordinates
    pen_lift.py     how a pen comes down and goes up: values, speeds, waits
    dialects/       what all dialects have in common, and one package each
    ports.py        how bytes reach a machine; connections.py opens the way to one and finds out who is there
    driver.py       `run` and `draw`: send a plan, tell how far it is, and whatever happens leave the pen lifted
    overlap.py      how much ink may be under way: no more than may be drawn twice, never at the price of a rest
    observation.py  what was executed, and where the pen rested, from the machine's own answers; how alike it is
    plot_report.py  the report of a plot, by page, in facts and in a sentence
    jobs/           plots that survive: parts, pages, the journal; `jobs.runner` draws what is left of one
    pen_heights.py  how high the pen is lifted and how low it is let down, found step by step; moves by hand
    setup_sheet.py  the test sheet that shows what can be set on a machine, and how it is read

Profiles of machines are files (`devices/`), simulated machines live in `handout.simulated.plotter`.  To add a step of
planning see `planning`; a dialect `dialects`; a panel of the test sheet: write it in `setup_sheet`
and name it in `_panels` and `how_to_read` there.
"""

from handout.plotting.bed import fit_to_bed
from handout.plotting.connections import open_port
from handout.plotting.dialects.grbl import to_gcode
from handout.plotting.driver import PlotReport, run
from handout.plotting.planning.plan import Plan
from handout.plotting.planning.planner import plan
from handout.plotting.ports import Port, serial_ports

__all__ = ["Plan", "PlotReport", "Port", "fit_to_bed", "open_port", "plan", "run", "serial_ports", "to_gcode"]
