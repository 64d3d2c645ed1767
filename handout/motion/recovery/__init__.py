"""How the pen went: from the line that it left to paths in the order of writing.

- `network` makes branches between knots of a line graph, and `walks` finds ways over all of them that cost a hand the
  least (`prices`);
- `models` and `likeness` compare those with how a letter is usually written, which the drawn hands and `ductus` know;
  `guide` leads the search along it, `marks` says where strokes may begin in mid-branch;
- `letters` does that for one letter's line (`lines`), with its `dots`, `bars` and `loops`;
- `scribe` does it for the glyphs of a scanned hand: `spanning` finds the bars that run over several letters, `author`
  tells how the same letter is written elsewhere, `failing` where ink has failed and where the pen was lifted;
- `pages` joins the letters (`placing`) along the ligatures of a written page; `weaving` does where the pen went to and
  fro between two letters, `stitching` where it went back over its own ink;
- `pacing` and `timing` say how fast, and `recorded` keeps what a recorded pen has told.
"""
