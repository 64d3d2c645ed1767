"""From a `Plan` to a machine, and what it made of it.

    driver.py       `run` and `draw`: send a plan, tell how far it is, and whatever happens leave the pen lifted
    overlap.py      how much ink may be under way: no more than may be drawn twice, never at the price of a rest
    observation.py  what was executed, and where the pen rested, from the machine's own answers
    fidelity.py     how alike two drawings of the same strokes are: paths, speeds, times
    plot_report.py  the report of a plot, by page, in facts and in a sentence

What the machine is asked and answers is in its dialect (`plotting.dialects`); the driver knows only a `Controller`.
"""
