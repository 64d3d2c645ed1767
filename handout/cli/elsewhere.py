"""Options of other plotter programs (axicli, saxi), and what they are here; see docs/other-programs.md."""

from __future__ import annotations

_HEIGHTS = "in the servo's own values or in mm of a Z axis, and not per cent"
_PROFILE = "in the machine's profile (handout devices show)"
_OURS = {
    "pen-pos-up": f"--pen-up, {_HEIGHTS}",
    "pen-pos-down": f"--pen-down, {_HEIGHTS}",
    "pen-up-height": f"--pen-up, {_HEIGHTS}",
    "pen-down-height": f"--pen-down, {_HEIGHTS}",
    "speed-pendown": f"limits.draw_speed {_PROFILE}, or --speed 1.5 for a faster hand",
    "speed-penup": f"limits.travel_speed {_PROFILE}",
    "pen-down-max-velocity": f"limits.draw_speed {_PROFILE}",
    "pen-up-max-velocity": f"limits.travel_speed {_PROFILE}",
    "accel": f"limits.acceleration {_PROFILE}",
    "pen-down-acceleration": f"limits.acceleration {_PROFILE}",
    "pen-up-acceleration": f"limits.acceleration {_PROFILE}",
    "pen-down-cornering-factor": f"limits.junction_deviation {_PROFILE}",
    "pen-rate-lower": f"pen.ramp {_PROFILE}",
    "pen-delay-down": f"pen.down_time {_PROFILE}",
    "pen-delay-up": f"pen.up_time {_PROFILE}",
    "pen-drop-duration": f"pen.down_time {_PROFILE}",
    "pen-lift-duration": f"pen.up_time {_PROFILE}",
    "preview": "--dry-run preview.svg",
    "rendering": "--dry-run preview.svg --show-travel",
    "report-time": "nothing: the time is always said",
    "reordering": "--order travel",
    "sort-paths": "--order travel",
    "page-delay": '--after-page "wait 15s"',
    "model": "--device axidraw-v3-a3, or another of handout devices list",
    "penlift": "--device axidraw-v3-brushless, or another of handout devices list",
    "mode": "--resume, --layers, or handout pen",
    "output-file": "--dry-run file.svg",
    "paper-size": "--page A5",
    "landscape": "--page 210x148mm",
    "portrait": "--page 148x210mm",
    "fit-page": "--fit",
}


def hint(option: str) -> str | None:
    """What an option that is not there is called here, in a sentence; None: nobody knows it."""
    ours = _OURS.get(option.lstrip("-").replace("_", "-"))
    return None if ours is None else f"{option} is not an option here: {ours}."
