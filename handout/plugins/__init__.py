"""Ways into other programs. Each needs that program and is loaded by it alone."""
