"""What an author is asked to write: few sentences that hold a text's letters, on sheets that are found again in a scan.

    corpus ─► sentence_choice ─► prompt_pages ─► sheet_pdf ─► paper ─► scan ─► sheet_detection ─► page upright, its text
                 └─► coverage       sheet_layout, sheet_codes ────────────────────┘

- `corpus`: sentences to choose from, the shipped ones (`corpus.txt`) or those of any text
- `sentence_choice`: which of them add most; `prompt_pages`: pages filled with them; `coverage`: what letters they give
- `sheet_layout`: where fiducials, codes, lines and words are; add a paper size here (`PAPERS`)
- `sheet_codes`: the text of a page as QR codes, written and read; `sheet_pdf`: the sheets as a PDF
- `registration`: from the fiducials in a picture to where the sheet lies; `sheet_detection`: which page it is

Source: seed 000, §4.1.
"""
