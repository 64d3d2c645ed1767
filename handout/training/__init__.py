"""Makes what ships: trains the networks and writes the scanned hands.  Nothing that runs imports it."""
