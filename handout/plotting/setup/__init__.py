"""A machine set up with a person who looks.

sheet.py          the test sheet: its parts packed on a page, its words, and how it is read
panels.py         the parts of the test sheet; to add one, write it here and name it in `sheet._panels` and
                  `sheet.how_to_read`
pen_heights.py    how high the pen is lifted and how low it is let down, found step by step
saved_heights.py  a copy of a profile with other heights
manual.py         a connected plotter moved by hand: pen, zero, a little way
"""
