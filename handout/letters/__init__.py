"""Letter files: Markdown with a head, laid out as people write letters.

- `document`: what a letter holds: blocks, spans of text, and the head, frozen and with the lines of the source.
- `letter_file`: Markdown → document.
- `runs`: the text of a document in its hands, each word set but without a place.
- `setting`: the words, lists, tables and pictures of a document on its pages.
- `ornaments`: underlines, bullets, rules and flourishes, as strokes.
"""

from __future__ import annotations

from handout.letters.document import LetterFile as LetterFile
from handout.letters.letter_file import load as load
