"""Stand-ins, in the computer, for the machines at the ends of the program: what ``sim:`` and ``--printer sim`` name.

    plotter/        a pen plotter with the firmware of each dialect, behind a port; what the addresses ``sim:`` lead to
    print_and_scan  prints and scans documents in the place of the user: ``--printer sim``
    printer         an inkjet with faults on demand
    scanner         scans what the simulated printer printed; flatbed: its settings, glass and optics
    spectra         reflectance from 400 to 700 nm, the colours that it is, and a printed sheet

Tests and benchmarks import this room.  The product loads it only where a user asks for a simulated device, inside the
function that needs it; `tests/test_architecture.py` fails where a module of the product imports it at its head.
"""
