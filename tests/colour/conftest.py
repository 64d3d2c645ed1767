"""Tests of this room draw their own prints and scans."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
