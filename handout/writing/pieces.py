"""A text in pieces: what is written in one go, and the spaces between."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from handout.writing.text import Letter

_BREAK_AFTER = "-–—/"

# a number of spaces, or the letters between two of them
Piece = int | Sequence[Letter]


def paragraphs_of(tokens: Iterable[Letter | str]) -> Iterator[list[Piece]]:
    """What is written in one go, and between that the numbers of spaces, of one paragraph after the other."""
    return (list(_pieces(paragraph)) for paragraph in _split(tokens, "\n"))


def _split(tokens: Iterable[Letter | str], mark: str) -> Iterator[list[Letter | str]]:
    part: list[Letter | str] = []
    for token in tokens:
        if token == mark:
            yield part
            part = []
        else:
            part.append(token)
    yield part


def _pieces(paragraph: Sequence[Letter | str]) -> Iterator[Piece]:
    """What is written in one go, and between them the number of spaces; a line may break after a hyphen."""
    piece: list[Letter] = []
    spaces = 0
    for token in paragraph:
        if isinstance(token, str):
            if piece:
                yield piece
                piece = []
            spaces += 1
            continue
        if spaces:
            yield spaces
            spaces = 0
        if len(piece) > 1 and piece[-1].base in _BREAK_AFTER and token.base.isalpha():
            yield piece
            piece = []
        piece.append(token)
    if piece:
        yield piece
