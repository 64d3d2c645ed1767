"""A printer's colours as the scanner of the hand sees them: models of both, tables that correct them, their limits.

Device RGB is what is sent to the printer; scanned RGB is what the flatbed shows of the print.  A table turns the colour
that a scan of the page should show into the colour to send, so the loop of printer, paper and scanner is closed.

    chart          the calibration chart: its colours and places
    chart_files    the chart as the printer's own pixels, and as .ti1, .ti2 and .ti3 tables
    reading/       from scans of the chart to the colour of each patch, with checks of scan and print
    models/        patches, as sent and seen; models of printer, paper and scanner: forward, inverse, their splines
    table          the colour table, pages through it, and which ink the printer cannot reach
    exports, icc   a table in the formats of other programs
    cgats          tables of colours as text
    ink_match      the lines of a pen in two scans: what do other settings make of its ink
    conversions    scanned RGB as CIE colours, ΔE00 (colour-science)
    report         what was read of a chart, as HTML

To add: a check of a scan in `reading.picture_checks` or `reading.print_checks`, an output format in `exports`, a model
in `models` (its name in `METHODS` below).

Source: seed 000, §7.1 and Appendix K.
"""

# how a table can be made of patches, see `models.fit`; here, because the command lists them in its help
METHODS = ("forward", "tps", "tps-haines2016")
