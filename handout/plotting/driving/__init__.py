"""From a `Plan` to a machine: streaming it, bounding what may be drawn twice, and measuring what was executed."""
