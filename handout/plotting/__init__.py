"""From timed strokes to a machine: plan a drawing, open a port, run the plan; or write it as a plotter's program.

A drawing becomes a `Plan`, the plan becomes commands in the dialect of the machine, and these go through a `Controller`
with the dialect's own flow control to a port.  In that order:

    planning/       what plans: a drawing → a `Plan`, without a machine; `planning.planner` has the steps, and is where
                    the time of every stroke is decided
    bed.py          where a page lies on the machine: the only place that turns page into machine coordinates
    pen_lift.py     how a pen comes down and goes up: values, speeds, waits
    dialect.py      what all dialects have in common; dialects/ has one package each
    ports.py        how bytes reach a machine; connections.py opens the way to one and finds out who is there
    driving/        what drives: a plan → a machine, and what was executed
    jobs/           plots that survive: parts, pages, the journal; `jobs.runner` draws what is left of one
    setup/          a machine set up with a person who looks: test sheet, heights of the pen, moves by hand

Profiles of machines are files (`devices/`), simulated machines live in `handout.simulated.plotter`.  To add a step of
planning see `planning`; a dialect `dialects`; a line of the test sheet `setup.panels`.
"""

from handout.plotting.bed import fit_to_bed
from handout.plotting.connections import open_port
from handout.plotting.dialects.grbl import to_gcode
from handout.plotting.driving.driver import PlotReport, run
from handout.plotting.planning.plan import Plan
from handout.plotting.planning.planner import plan
from handout.plotting.ports import Port, serial_ports

__all__ = ["Plan", "PlotReport", "Port", "fit_to_bed", "open_port", "plan", "run", "serial_ports", "to_gcode"]
