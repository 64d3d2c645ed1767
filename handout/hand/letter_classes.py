"""Classes of letters by their shape: the one place that says which letters ascend, descend, are dotted or crossed.

Small letters only, unless a class says otherwise.  Where two classes look alike, each says in what they differ.
"""

from __future__ import annotations

from string import ascii_lowercase

LOWERCASE = frozenset(ascii_lowercase)

# upwards
ASCENDING = frozenset("bdfhklt")  # taller than the x-height, however much
FULL_ASCENDERS = frozenset("bdhkl")  # that reach the ascender height: t ends lower, f is curled over
LOOPED_ABOVE = frozenset("bfhkl")  # whose stem is looped in a joined hand: those of d and t are retraced
NOT_ASCENDING = LOWERCASE - ASCENDING

# downwards
DESCENDING = frozenset("gjpqy")  # below the baseline in every hand
LOOPED_BELOW = frozenset("gjyz")  # whose tail is looped backwards in a joined hand: z has one there, p and q none
NEVER_DESCENDING = LOWERCASE - DESCENDING - LOOPED_BELOW - {"f"}  # a joined f may go below the line

# strokes across and loops
DOTTED = frozenset("ij")
CROSSED = frozenset("tf")  # with a crossbar that is a stroke of its own in every joined hand
CROSSED_CAPITALS = frozenset("AEFHT")
CROSSED_ASLANT = frozenset("xX")  # by a straight stroke from above
ENDING_HIGH = frozenset("vwVWνω")  # whose last stroke goes up and is their own, wherever the pen goes from there
BOWLED = frozenset("acdegoqCGOQ06")  # letters and figures whose loops, but those of tails, go anticlockwise

X_HEIGHT = NOT_ASCENDING - DESCENDING - DOTTED  # neither ascender nor descender nor dot: these are one x-height high
FLAT_FIRST = "xzvuwneorsacm"  # the same, those with flat tops first: round ones overshoot
STEM_AT_LEFT = frozenset("DL")  # capitals that are crossed at their one stem, not in their middle
