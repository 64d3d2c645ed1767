"""Classes of letters hang together."""

from handout.hand import letter_classes as classes


def test_a_letter_is_of_x_height_or_stands_out_in_one_way():
    parts = [classes.ASCENDING, classes.DESCENDING, classes.DOTTED - classes.DESCENDING, classes.X_HEIGHT]
    assert frozenset().union(*parts) == classes.LOWERCASE
    assert sum(map(len, parts)) == len(classes.LOWERCASE)


def test_narrower_classes_are_parts_of_the_wider():
    assert classes.FULL_ASCENDERS | classes.LOOPED_ABOVE | classes.CROSSED <= classes.ASCENDING
    assert not classes.NEVER_DESCENDING & (classes.DESCENDING | classes.LOOPED_BELOW)
    assert sorted(classes.FLAT_FIRST) == sorted(classes.X_HEIGHT)
