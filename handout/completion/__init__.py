"""Letters that a scanned hand lacks, added to it before a text is set: put together from its own ink, or lent.

An accented letter is the author's own letter under the author's own mark.  What the author never wrote is lent, where
the user accepts that: made after the author's other letters, in the author's ink.  `completed_hand.complete_hand` is
the way in; nothing here sets text.

    completed_hand.py   which letters of a text a hand lacks, and the hand with them on one page more
    letters.py          makes the forms of one letter of the author's ink: which source, where a mark sits
    manner.py           how the author would write a letter, as his others depart from those of the built-in hands
    ways.py             those letters as ways of the pen, and such a way bent onto a glyph
    drawn_letters.py    what the manner gives, as lines; marks and, for want of letters, forms of a built-in hand
    specimens.py        letters in the making, as lines in line space, and the page that holds them, inked

To lend a letter from another source, add it to `letters.LetterMaker.make`; tests/completion shows what it must give.
Accents and where they sit are named in one place for drawn and scanned hands, `hand`; see there.
"""
