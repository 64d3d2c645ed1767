"""The Internet Printing Protocol, versions 1.1 and 2.0: what is needed to print one page and to know what became of it.

`message` is pure (values ↔ bytes), `link` moves bytes, `client` knows the operations, `words` says what printers say
in words, and `simulated` is a printer inside the computer, with faults on demand.
"""
