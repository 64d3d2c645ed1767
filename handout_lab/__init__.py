"""The laboratory: what measures, tries and trains handout, and the verbs `study` and `score`; the product needs none.

    author/    writes with a built-in hand and a simulated pen, and knows the truth about every pixel
    ipp/       an IPP printer on this computer, with faults on demand: ``python -m handout_lab.ipp``
    reading/   reads the paths of a pen
    score/     how far page images and motion look made by a person
    study/     questionnaires on which people tell made writing from real, and a person in the computer who answers them
    training/  what makes the networks, styles, brushes and hands that ship
    pipeline/, cli/   the verbs, as those of the product; it finds them by their entry points (`handout.verbs`)
    offset_press      an offset press whose colours were measured (FOGRA39)
    ink_comparison    whether the ink on a simulated plotter's paper is the ink that was intended

The laboratory imports the product; tests and benchmarks import both.  `tests/test_architecture.py` fails where the
product imports the laboratory.
"""
