"""From scans of the chart to what the printer made of each colour, and what is wrong with them.

file ─► opening ─► registration ─► sampling ─► flatness ─► merging of scans and repeats ─► device, scanned, deviation
           └──────────────┴─────── picture_checks, print_checks, printer_checks ──► findings
"""

from handout.colour.reading.chart_reading import ChartReading, SheetReading, read_scans
from handout.colour.reading.pen_field import Scribble
from handout.colour.reading.scan_files import ChartScan, ScanFinding, ScanRefused, open_scans

__all__ = [
    "ChartReading", "ChartScan", "ScanFinding", "ScanRefused", "Scribble", "SheetReading", "open_scans", "read_scans",
]  # fmt: skip
