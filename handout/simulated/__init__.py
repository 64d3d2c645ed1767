"""Stand-ins, in the computer, for the machines at the ends of the program: what ``sim:`` and ``--printer sim`` name.

    printer/   an inkjet with faults on demand; what ``--printer sim`` prints with
    plotter/   a pen plotter with the firmware of each dialect, behind a port; what the addresses ``sim:`` lead to
    scanner/   a flatbed; scans what the simulated printer printed
    sheet      a printed sheet: inks, paper, and what was written on it afterwards
    spectra    reflectance from 400 to 700 nm, and the colours that it is
    print_and_scan  prints and scans documents in the place of the user: ``--printer sim``

Tests and benchmarks import this room.  The product loads it only where a user asks for a simulated device, inside the
function that needs it; `tests/test_architecture.py` fails where a module of the product imports it at its head.
"""
