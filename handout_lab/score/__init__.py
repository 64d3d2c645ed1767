"""Likeness without people: how like real handwriting a page is, and how like its author's.

- `written_lines`: a page as grey pixels at 300 dpi, its ink by Otsu, its lines and words.
- `hinge`, `quill`, `run_lengths`: three histograms that tell writers apart.
- `statistics`: what a ruler says (slant, gaps, sizes, and how much they waver).
- `repetition`: the share of letters that have a twin, the surest sign of a machine.
- `features`: what of these is compared of a page and of a line.
- `comparison`: a made page against its author's, and the rank of a page among other writers' pages.
- `two_sample`: whether a classifier tells made lines from real ones.
- `motion_judge`: whether a recurrent network tells made motion from recorded, writers kept apart.

A measure of likeness is a module beside `hinge`, and a field in `features`.
"""
