"""Reconstruction: finds the plan of a movement from its trace, with or without its times.

Source: seed 002, §3.2.
"""

from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.reconstruction.recording_fit import from_recording
from handout.motion.reconstruction.shape_fit import from_shape

__all__ = ["LognormalPlan", "from_recording", "from_shape"]
