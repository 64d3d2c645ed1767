"""What is drawn in the tests of plotters, which these share."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
