"""From timed strokes to a machine: plan a drawing, open a port, run the plan; or write it as G-code.

A `Drawing` becomes a `Plan` within a machine's limits (`planning`), the plan becomes commands (`dialects`), and these
go through a `Controller` with the flow control of its dialect to a `port`, of which one is a simulated
plotter (`handout.simulated.plotter`).
"""

from handout.plotting.bed import fit_to_bed
from handout.plotting.connections import open_port
from handout.plotting.dialects.grbl import to_gcode
from handout.plotting.driving.driver import Report, run
from handout.plotting.planning.plan import Plan
from handout.plotting.planning.planner import plan
from handout.plotting.ports import Port, serial_ports

__all__ = ["Plan", "Port", "Report", "fit_to_bed", "open_port", "plan", "run", "serial_ports", "to_gcode"]
