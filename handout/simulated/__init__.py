"""Simulators of what surrounds the program: for tests, benchmarks and trying out.

- `plotter`: a pen plotter with the firmware of each dialect, behind a port; the addresses ``sim:`` lead there.

The program itself loads a simulator only where the user asks for one, by one lazy look-up.
"""
