"""Text and a hand to manuscripts: glyphs chosen and placed on pages, without ink and without time.

`compose.each_page` is the pipeline; it calls each step once, in the order in which a text passes through:

- `text`: a text as paragraphs of words in the letters of a hand, or the complaint about those that it lacks
- `slips`: words begun wrongly, and how they are struck out
- `choosing`: which glyphs write each word, one search for every kind of hand; what that costs: `drawn_forms` (with
  accents), and for hands read from paper `glyph_index`; `explaining`: why, in words and pictures
- glyphs set side by side: `drawn_words` (with `variation`, every standard deviation), and `scanned_words`, which knows
  the author's `spacing`, lines (`forms`), joins (`joining`) and how far letters vary (`bending`)
- `layout`: page, margins, size, how lines lie; `pages`: words to rows, rows to pages, made to fit where that is asked
- `specimen`: apart from the pipeline, all forms of a hand on one sheet

A new kind of hand implements `pages.Handwriting` and `choosing.GlyphStock`, and is opened in `compose`; nothing else of
the room asks which kind a hand is.
"""
