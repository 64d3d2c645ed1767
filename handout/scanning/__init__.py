"""From a scanned page to ink: paper, density, mask, line graph, matte and the lines of writing.

`reading.read_page` does all of it; every step is a function of its own.

Source: seed 000, §5.1, §7.3 and Appendices A–C.
"""
