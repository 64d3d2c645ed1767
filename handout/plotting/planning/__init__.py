"""From a drawing to a `Plan`, without touching a machine: where the time of every stroke is decided."""
