"""Text and a hand to manuscripts: glyphs chosen and placed on pages, without ink and without time.

`compose.compose` does all of it.  In the order in which a text passes through:

- `text`: a text as paragraphs of words in the letters of a hand, or the complaint about those that it lacks;
  `lookalikes`: characters written alike, and what may stand for one that a hand lacks
- `slips`: words begun wrongly, and how they are struck out
- `line_writer`: the protocol that every kind of hand is written by
- `drawn_line_writer`: the line writer of drawn hands, with `choice` (which form; also what all choosers share),
  `accents`, `clearance` (letters, dots and bars out of each other's way) and `variation` (every standard deviation)
- `scanned`: the line writer of hands read from paper, with a list of its own
- `layout`: page, margins, size, how many lines a page holds; `line_breaking`: words to rows, made to fit where that is
  asked for; `baseline_model`: how lines lie, on blank and ruled sheets; `sheets`: rows to pages
- `specimen`: apart from the pipeline, all forms of a hand on one sheet

A new kind of hand implements `line_writer.LineWriter` and is opened in `compose.each_page`; nothing else asks which
kind it is.
"""
