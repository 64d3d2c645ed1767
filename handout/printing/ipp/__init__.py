"""The Internet Printing Protocol, versions 1.1 and 2.0: what is needed to print one page and to know what became of it.

    message.py      messages as values and as bytes: pure functions
    transport.py    bytes to a printer and back: one HTTP POST a request
    request.py      what is asked for a page; states and their reasons in words (a printer's unknown reason: here)
    client.py       the operations, repeated while the printer is busy
    queue.py        a printer as a `printing.queue.Queue`: hands a page over once, follows, judges the outcome of a job

The printer of the tests is `handout_lab.ipp`.
"""
