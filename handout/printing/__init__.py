"""Tables of addresses, and pages on their way to a printer.

A table becomes rows with addresses:

    table_files.py     the cells of a file: delimited text, Excel workbooks (a new file format: here)
    column_names.py    the names that columns have (a new name of a column: column_names.toml)
    columns.py         what columns hold, by their names or as the user says
    address_rows.py    the cells of a row as the fields of an address
    address_table.py   `read_addresses`: the whole table, and how it was read
    address.py         fields as lines, their order by country (a new country: here)
    rows.py            a row, and the choice of rows by number
    envelope.py        where the address stands, and the sender

Pages become jobs:

    prepared.py    what a destination needs of a row's pages, made by any process
    batch.py       `make_rows`: the prepared pages of every row taken in their order, and sent or filed
    sending.py     jobs one after the other, what became of them, what is left of a batch that broke off
    several.py     several devices that share the rows of a batch, each in a thread
    journal.py     what became of every page of a batch, on the disk
    media.py       how a page lies as it is fed, what its sheet is called (sizes are in `handout.page_sizes`)
    documents.py   a page as PDF, PWG Raster, URF, PNG (a new format: here)

Ways to a printer:

    printers.py    a printer by its name, and the way to it, such as CUPS (a new way is opened here)
    queue.py       what every way can do, and folders as queues
    ipp/           a printer that is spoken to directly

The colour of a printed pixel is decided in `handout.inking.device_pixels`.  Printers are files in `devices/`, and
``handout.simulated`` has printers that are not there.  `handout.pipeline.printing` puts this room together.
"""
