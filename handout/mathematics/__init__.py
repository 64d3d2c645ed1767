"""Formulas: found in a text, read from the TeX that people know, and laid out as people write them by hand.

A formula is a tree (`formulas`) whose leaves are short words; `parser` reads it, `signs` knows what commands mean.  The
hand sets the leaves as it sets any word; `layout` gives them their places and sizes, and `shapes` draws what grows
with its contents: rules, roots, brackets, sums and integrals.
"""
