"""Pose: how a pen is held, learned of recordings, and given to strokes that have none.

- `features`: strokes sampled in hand units, and what they look like around each sample.
- `library`: the strokes of one writer with their pose, and the .pose file.
- `synthesis`: a pose along a stroke, after strokes of a library that look alike.
- `posing`: drawings with a pose, and strokes drawn in the manner of a library, held to where they were meant to go.
"""
