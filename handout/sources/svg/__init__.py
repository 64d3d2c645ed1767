"""SVG files as drawings: what they stroke, as lines; and this program's own previews with their times."""

from handout.sources.svg.reading import from_svg

__all__ = ["from_svg"]
