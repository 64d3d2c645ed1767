"""Where every letter of a scanned page is, from the page and its transcript.

`align.align` does all of it: the lines are straightened (`linespace`), every column of them described (`features`) and
read by small networks (`network`, which `handout.training` trains), the transcript laid along what they read
(`decoder`), and the networks adapted to the page's own writing (`adaptation`) with synthetic lines to rehearse.

Source: seed 000, §5.1.3, §5.2 and Appendix D; that method itself is `chain`.
"""
