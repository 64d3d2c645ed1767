"""What an author is asked to write: sentences that cover a text's letters with little writing, the sheets they are
written on, and finding those sheets again in a scan.

    corpus, typed ─► choice ─► sheet (geometry) ─► printing (PDF) ─► paper ─► scan ─► finding ─► page upright, its text
                       └─► coverage                code ─────────────────────────────────┘

Source: seed 000, §4.1.
"""
