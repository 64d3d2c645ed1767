"""A simulated flatbed scanner: a sheet on the glass, lamp, optics, dust, sensor and tone curve."""
