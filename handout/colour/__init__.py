"""What a printer makes of the colours that it is sent: the chart that shows it, its scan, and tables made from these.

Source: seed 000, §7.1 and Appendix K.
"""
