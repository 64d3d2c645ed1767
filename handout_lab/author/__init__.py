"""A simulated author: a built-in hand writes with a simulated pen, a simulated scanner reads, and all of it is known.

    simulate            writes a page on a `Desk` and scans it
    truth               what is true of the scan: letters, paths, densities, the matte
    ink_ownership       which letter a pixel, a path and a split belongs to
    ground_truth_score  how near something found on the scan comes to the truth
    page_score          reads the page back as a user's scan is read, and scores its letters

No real scan can say where the pen went under its ink, which letter a drop of it belongs to, or what the paper looked
like before.
"""
