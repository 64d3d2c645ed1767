"""The application: what the verbs of the command do, as functions that any program may call.

The command line, the vpype plug-in and the notebook call this room and nothing below it; so does a script.  Nothing
here knows click or a terminal.  Files:

    options.py    what a caller may ask for, as frozen dataclasses: WritingOptions, SheetOptions, PictureOptions …;
                  declarations.py says how an option is declared
    results.py    what a call gives back: results that turn into JSON, and the notes that are told to the user
    writing.py    `write` and `export`, and the documents that it writes; texts.py prepares, sets and draws a text
    letters.py    a letter file and its pages; signatures.py keeps signatures
    hands.py      `read`, a hand from scans or recorded pens; kept_hands.py what is done with hands that there are
    letter_desk.py   the letters of a scanned hand, corrected one after another
    choices.py    what may be chosen by name
    prompts.py    `prompt`, sheets to write a hand on
    printing.py   `print_`, envelopes from a table of addresses
    drawings.py   `restyle`, `asemic`, and plans of strokes: `fit_strokes`, `draw_plans`
    styles.py     `learn_style`, and the handstyle that is asked for
    poses.py      `learn_pose`, `show_pose`, and the pose of what is written or drawn
    scoring.py    `score`, measures of page images
    inputs.py     what is to be written: a text, a file, standard input, or a drawing
    lined_paper.py   which lines of a paper are written on
    programs.py   files for plotters: how a page becomes one
    plotting.py   `plot`, `preview`, `resume`; plot_request.py has their options, plot_jobs.py the plots that are kept
    job_pages.py  the pages of a plot that are made while the first are drawn, by a program of its own
    pen_setup.py  a plotter's test sheet, the heights of its pen, the pen moved by hand
    names.py      what may be called by name, listed and checked without loading it
    doctor.py     `examine`, what the program needs of a computer; imports nothing that may be lacking
    devices.py    machines that have a profile, and who is plugged in

How a verb is built
-------------------
1. Its options are frozen dataclasses in `options.py`, named after what they describe; every field is declared once
   (`declarations.py`), with its default and its help.  They are in files that import nothing heavy, since the command
   reads them to show its help.  A length is a `Length`: a text with a unit, or a number of mm.  ``None`` means "not
   asked for", so nothing has to ask click whether a value came from the user.
2. The work is one function in the verb's file here, `verb(what, options…, *, listener=SILENT) -> Result`.  It reads
   like a table of contents, and it neither prints nor reads the terminal.  What the user should learn *while* it works
   goes to the `Listener`: `say` for a sentence, `progress` for the share that is done.  Where a machine moves it is an
   `Attendant`, who is also asked.
3. What the user should learn *afterwards* is data: a frozen dataclass in the verb's file that extends `results.Result`.
   `facts()` gives the JSON object that ``--json`` prints (the fields, unless it is overridden); the field `notes` has
   sentences on what was decided for the user: letters that were lent, parts that were left out, options that were not
   followed.
4. `cli/verb_.py` binds and prints, no more; it imports the verb's file when it is called, not before::

       @click.command("write")
       @click.argument("text", nargs=-1)
       @options.sheet("A4")        # gives the parameter  sheet: SheetOptions
       @options.writing            # gives the parameter  writing: WritingOptions
       @options.picture            # gives the parameter  picture: PictureOptions
       @options.console            # gives the parameter  console: Console (which is the Listener)
       def command(text: tuple[str, ...], sheet: SheetOptions, ..., console: Console) -> None:
           from handout.pipeline.writing import write

           result = write(text, ..., listener=console)
           console.note(*result.notes)
           console.report(result.facts(), f"Wrote {…}.")

   `options.bind("printing", PrintOptions)` gives the parameter  printing: PrintOptions.
5. `__init__` of this room and of `handout` name the function in their table of public names.
"""
