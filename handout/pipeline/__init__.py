"""The application: what the verbs of the command do, as functions that any program may call.

The command line, the vpype plug-in and the notebook call this room and nothing below it; so does a script.  Nothing
here knows click or a terminal.

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
3. What the user should learn *afterwards* is data, a `results.Delivery`: its `told` is the JSON object that ``--json``
   prints, its `notes` are sentences on what was decided for the user: letters that were lent, parts that were left out,
   options that were not followed.  What else a caller may want is a field of a class that extends it.
4. `cli/verb_.py` says what is typed, calls and prints, no more: the parameters of its function are the arguments and
   options of the verb (`cli.options.verb`).  It imports the verb's file when it is called, not before::

       @verb("write")
       def command(
           console: Console,                                     # --json and --quiet; it is the Listener
           text: tuple[str, ...],                                # an argument
           device: str | None = shared(None, "The plotter …"),   # an option
           sheet: SheetOptions = SheetOptions(usual_page="A4"),  # all options that the dataclass declares
       ) -> None:
           from handout.pipeline.writing import write

           result = write(text, ..., listener=console)
           console.report(result, f"Wrote {…}.")

5. `__init__` of this room and of `handout` name the function in their table of public names.
"""
