"""Reads a scanned page: paper, inks, density, mask, line graph, matte and text lines.

`written_page.read_page` does all of it; every step is a function of its own, here in their order:

- `scan`: the nouns `Picture` (what a file holds) and `Scan` (a picture of known resolution)
- `picture_files`: reads them from files; `pdf_pages`: a format that needs more than Pillow
- `checks`: everything that can refuse a scan; add a check here.  `page_layout`: two checks of the whole picture
- `line_erasure`: printed rules and squares taken out, which `printed_lines` finds
- `paper`: light, stains and borders; `inks`: the colours of paper and inks
- `density`: how much ink lies on every pixel
- `mask`: which pixels are ink, by `graph_cut`
- `skeleton`, `line_graph`: the line that the pen left, with its width
- `matting`: the ink without its paper
- `baselines`, `text_lines`: where the lines of writing run, and which ink is whose
- `written_page`: the pipeline, and what it gives; ink that is not the page's
- `printed_lines`: apart from the pipeline: what is printed on a sheet that is to be written on

Source: seed 000, §5.1, §7.3 and Appendices A–C.
"""
