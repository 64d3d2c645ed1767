"""Paths of a graph, told by walking it edge by edge."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.branching import branches

PAIRS = st.integers(2, 12).flatmap(
    lambda count: st.tuples(
        st.just(count),
        st.lists(
            st.tuples(st.integers(0, count - 1), st.integers(0, count - 1)).filter(lambda pair: pair[0] != pair[1]),
            unique_by=lambda pair: tuple(sorted(pair)),
            max_size=16,
        ),
    )
)


def _graph(pairs):
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(PAIRS)
def test_every_edge_is_on_one_path_and_paths_end_where_lines_do(graph):
    count, pairs = graph
    degree = np.bincount(_graph(pairs).ravel(), minlength=count)
    found = [path.tolist() for path in branches(_graph(pairs), count)]
    walked = [tuple(sorted(step)) for path in found for step in pairwise(path)]
    assert sorted(walked) == sorted(tuple(sorted(pair)) for pair in pairs)
    for path in found:
        assert all(degree[vertex] == 2 for vertex in path[1:-1])
        if len(path) == 1:
            assert degree[path[0]] == 0
        elif degree[path[0]] == 2:
            assert path[0] == path[-1] == min(path)
        else:
            assert degree[path[-1]] != 2


def test_paths_come_by_their_first_vertex_and_run_from_their_first_end():
    # a tail 5 – 4 – 3 at a junction 3, a loop 0 – 1 – 2 apart, and a dot 8
    pairs = [(4, 5), (3, 4), (3, 6), (3, 7), (1, 2), (0, 1), (2, 0)]
    found = [path.tolist() for path in branches(_graph(pairs), 9)]
    assert found == [[0, 2, 1, 0], [5, 4, 3], [3, 6], [3, 7], [8]]
