"""Reconstruction: the plan of a movement from its trace, with its times or without.

Source: seed 002, §3.2.
"""

from handout.motion.reconstruction.geometry import from_shape
from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.reconstruction.timing import from_recording

__all__ = ["LognormalPlan", "from_recording", "from_shape"]
