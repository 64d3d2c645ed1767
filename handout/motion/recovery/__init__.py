"""How the pen went: from scanned ink to paths in the order of writing.

A glyph is traced alone, with what its word tells of it; then the glyphs of a word are joined:

- `network`: a line graph as branches between nodes, and what movements over them cost a hand;
- `letter_forms`, `form_matching`: how letters are usually written, and how far a traversal is from that (DTW);
- `traversal`: beam search of the cheapest ways of a pen over all branches, alone or guided by a form;
- `letter_line`: the line of one letter, its dots, and loops that run the wrong way round;
- `crossbars`: bars of t, f and x, in a letter and over several;
- `ink_gaps`: where ink failed and where the pen was lifted;
- `letter_tracing`: one letter's line as strokes, from all of these;
- `writer_habits`, `stroke_order`: a hand's glyphs, each as its writer writes that letter elsewhere;
- `placed_strokes`, `pen_paths`: the strokes of a placed word, merged and joined: the paths of a page.

`motion.timing` says how fast the pen goes along them.  A way of writing a letter is added in `ductus.toml`.
"""
