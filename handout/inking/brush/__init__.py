"""Brushes that paint as photographs of their strokes do: segments of the strokes, put together anew along any path.

- `photographs`: the strokes of a picture, with their middle lines
- `ribbon`: a stroke straightened, cut into segments, with the features that these are chosen by
- `synthesis`: which segments make a stroke, exactly or by the seed's two passes
- `painting`: cuts between segments, and a ribbon laid along a path
- `brushes`: a brush learned, kept in a file and found; `canvas`: the strokes of a drawing; `sheet`: a brush shown

Source: seed 004.
"""
