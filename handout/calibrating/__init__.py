"""From a printed chart to a stored calibration, and pages through it: what a user does about colour, without a terminal.

Source: seed 000, §7.1.
"""
