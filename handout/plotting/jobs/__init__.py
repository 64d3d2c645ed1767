"""A plot that survives: what is to be drawn, in which parts, and how far it has come, kept in a folder of its own.

A *job* is one or several *parts* drawn one after the other, each a piece of a page drawn with one pen; before a part
the person may have to change the sheet or the pen.  `job` is the noun; `store` keeps the jobs, `journal` how far each
has come, `running` plots what is left of one.  The pages of a long text may still be made while the first are drawn:
`pages` keeps them one by one, `supply` is the program that makes them.
"""
