"""From a printed chart to a stored calibration, and pages through it: what a user does about colour.

Source: seed 000, §7.1.
"""
