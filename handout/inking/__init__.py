"""Ink on paper, as pixels and as outlines: of drawings with a pen, and of manuscripts in the ink of scanned hands.

Drawings:
- `pen`: a pen's width and colour, and the list of models; `plain`: a line of even colour; `pens`: lines that look like
  ink, with `flow` (what a pen gives along a stroke) and `deposit` (where that lies on the page)
- `curves`: strokes as Béziers that keep their time; `outline`: a stroke's mark as polygons, and flat nibs
- `papers`: sheets to show ink on, and their tooth
- `brush`: lines painted with pieces of photographed strokes

Manuscripts of scanned hands:
- `texture`: the ink of a page, glyph by glyph, from `source` (where ink is cut from a scan, and how its surroundings
  move), through `warping` (onto the page) and `layers` (with seams between glyphs that show one line)
- `pen_replacement`: another pen's ink along the same line, from `swatches`

A pen is added in `pen` (its usual width and colour) and `pens` (its model), a paper in `papers`.
"""
