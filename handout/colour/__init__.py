"""A printer's colours as the scanner of the hand sees them: models of both, tables that correct them, their limits.

Device RGB is what is sent to the printer; scanned RGB is what the flatbed says of the print.  A table turns the colour
that a scan of the page should show into the colour to send, so the loop of printer, paper and scanner is closed.

Source: seed 000, §7.1 and Appendix K.
"""
