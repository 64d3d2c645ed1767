"""A letter and a table become many letters: what fills the gaps of a letter, and what lies on one sheet.

template.py   a letter as a template, read once and filled for every row
fields.py     the columns of a table as a letter names them, and how a row wants to be made
sheets.py     several drawings on one sheet
"""
