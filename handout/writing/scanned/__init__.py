"""Writing in a hand that was read from paper; `line_writer.ScannedLineWriter` does all of it.

- `extraction`: all lines of a hand off their pages; `forms`: each glyph's body and connectors, to be set anywhere
- `glyph_index`: what choosing knows of every glyph; `candidates`: the letters of a text and the glyphs for each
- `choice_costs`: every cost of choosing and its weight (add one here); `outlier_cost`: glyphs unlike their kind
- `choosing`: the cheapest sequence of glyphs; `explaining`: why it was chosen
- `spacing`, `heights`: how far apart and how high glyphs stand; `joining`: ligatures between glyphs that were not
  neighbours; `bending`: no glyph twice the same; `layout_model`: all of that together, and a line set by it
- `baseline_model`: how the author's own lines lie
"""
