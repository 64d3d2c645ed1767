"""What an author is asked to write: few sentences that hold a text's letters, on sheets that are found again in a scan.

    corpus ─► sentence_choice ─► prompt_pages ─► sheet_pdf ─► paper ─► scan ─► sheet_detection ─► page upright, its text
                                    sheet_layout, sheet_codes ────────────────────┘

- `corpus`: sentences to choose from, the shipped ones (`corpus.txt`) or those of any text
- `sentence_choice`: which of them add most, and what letters they give; `prompt_pages`: pages filled with them
- `sheet_layout`: where fiducials, codes, lines and words are, also in a picture; add a paper size here (`PAPERS`)
- `sheet_codes`: the text of a page as QR codes, written and read; `sheet_pdf`: the sheets as a PDF
- `sheet_detection`: which page lies in a picture

Source: seed 000, §4.1.
"""
