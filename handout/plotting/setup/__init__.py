"""Trying a machine out: a sheet that shows what to set, and the heights of its pen."""
