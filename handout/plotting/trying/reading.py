"""What the test sheet says, in words: which line to look at, and which key of the profile it sets."""

from __future__ import annotations

from handout.profiles import Plotter

_OWN_STEPS = {
    "grbl": "$100 (x), $101 (y)",
    "marlin": "M92 X, Y",
    "ebb": "limits.steps_per_mm",
}


def how_to_read(profile: Plotter) -> list[str]:
    """One line for every part of the sheet."""
    said = ["Square: measure its sides with a ruler; if they are off,"]
    if profile.dialect in _OWN_STEPS:
        said[0] += f" steps per mm ({_OWN_STEPS[profile.dialect]}) = now x printed length / measured length."
    else:
        said[0] += " the plotter's scale is set on itself (P1, P2)."
    said[0] += " Unequal diagonals: the axes are not square."
    said += [
        "Play: the number beside the pair of marks that makes one straight line is the backlash, mm; none is best. "
        "Tighten belts or screws.",
        "mm/s, zigzags: the last row that is not shaken is limits.draw_speed.",
        "mm/s, loops: if the last rows are shaken, lower limits.acceleration.",
        "Circles: flats at the quarters are play; ends that do not meet are a pen that is loose in its holder.",
    ]
    if profile.pen.lift != "own":
        said += [
            "start: the first line that begins on the rule says how many ms to add to pen.down_time.",
            "end: a tail beyond the rule reaches about to the number of ms to add to pen.up_time.",
        ]
    return [*said, "dots: all should be there, none should blot; pen.ramp lowers the pen more slowly."]
