"""A simulated author: a built-in hand writes with a simulated pen, a simulated scanner reads, and all of it is known.

`simulate` makes a page; `judge` measures what somebody else found on it.  No real scan can say where the pen went
under its ink, which letter a drop of it belongs to, or what the paper looked like before.
"""
