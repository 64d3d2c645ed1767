"""Finds every letter of a page, given its transcript, and makes a hand of the pages.

The way of a scan: `page_sources` → `page_tagging.tag_page` → `alignment.align` → `letter_assignment` →
`glyph_extraction` → `page_tagging.hand_of_pages`.

- `page_sources`: files, transcripts and filled prompt sheets as pages to be read; runs the way for all of them;
  which way round a page lies, told by how well its text fits; `print_removal`: what is printed on such a sheet
- `page_tagging`: from a read page and its transcript to its glyphs, and from pages to a hand
- `alignment`: where every letter is; `segmentation`: the method, with a round of self-training
- `transcript`: a transcript as lines of letters; which line has which, and how well it fits: `alignment`
- `alphabet`: the letters that the networks tell apart; add one here, then train anew
- `line_space`: straightened lines and features of their columns; `network`: reads these; `decoder`: lays letters along
- `letter_assignment`: which letter every vertex of the line graph belongs to
- `glyph_extraction`: what a hand keeps of a page
- `recorded_pages`: recorded pens and single-line fonts as pages
- `synthetic_lines`: lines by synthetic writers of known letters, for training and for adapting to a page
- `networks/`: the shipped networks, which `handout_lab.training.letter_networks` trains

Source: seed 000, §5.1.3, §5.2 and Appendix D.
"""
