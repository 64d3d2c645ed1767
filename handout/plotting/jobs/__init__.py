"""Plot jobs, stored so that they survive interruptions: what is to be drawn, in which parts, and how far it is done.

A *job* is one or several *parts* drawn one after the other, each a piece of a page drawn with one pen; before a part
the person may have to change the sheet or the pen.

    store.py          the noun, and where jobs are kept
    parts.py          a job's parts: sheets, layers, stops for a look at the pen; and which part of a plot is asked for
    pages.py          the pages on the disk, each a drawing and its record, and the program that makes those of a long
                      text while the first are drawn
    places.py         a place on a drawing: how far it is drawn, what is left, where a machine stands
    journal.py        how far a job has come, in lines that survive a power cut
    runner.py         plots what is left of a job
"""
