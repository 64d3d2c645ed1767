"""SVG files as drawings: what they stroke, as lines; and this program's own previews with their times.

`document` walks the elements, `frames` and `styles` say where and how they are drawn, `reading` makes strokes of them.
Kept by hand beside `handout.pathdata` rather than taken from svgelements 1.9: that gives the same cubics, a third as
fast for path data, but draws what is hidden, masked, behind a `switch` or a `symbol` nobody uses (and that unscaled),
takes broken paths and transforms in silence, recurses without end where a `use` uses itself, and counts nothing of what
is left out.
"""

from handout.sources.svg.reading import from_svg

__all__ = ["from_svg"]
