"""Measured comparisons.  ``python -m benchmarks`` lists them, ``python -m benchmarks NAME`` runs one.

Each prints ratios of times taken in the same run on the same machine, since times alone say more about the machine
than about the program.
"""
