"""The study of a hand: printed questionnaires in which people tell real writing from made, read back and scored.

    snippets.py   words cut from a writer's pages, and the hand without their lines, in which the same words are made
    evenness.py   what would tell the made ones without looking at the writing
    design.py     who sees what: balanced and seeded; the key, sealed by the study's own name
    sheets.py     where everything is on a sheet, its code, and the sheets as a PDF
    marks.py      what a pen did to the boxes of a row: ticked, withdrawn, doubtful
    answers.py    scans to answers, and their table
    scoring.py    answers and key to shares, intervals, difficulty, confusions; figure.py draws them

Source: seed 000, §8.2 and figure 14; seed 001, §5.2 and table 1.
"""
