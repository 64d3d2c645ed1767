"""A simulated IPP printer on this computer: `printer` (what it does, its faults), `server` (its HTTP side).

``python -m handout_lab.ipp FOLDER`` runs one, to see what handout does when a printer fails.
"""
