"""Trembling, lines, averaging and slopes, each against cases worked out by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.export.keys import average_keys, central_slopes, line_keys, smooth_curve, steady_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

T: NDArray[np.float64] = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])


def test_an_extremum_quicker_than_the_frequency_goes() -> None:
    # up, up, down, down, up: keys 2 and 4 turn back, and their neighbours are 0.2 s apart
    values = np.array([0.0, 1.0, 2.0, 1.0, 0.0, 1.0])
    np.testing.assert_array_equal(steady_keys(T, values, 4.0), [0, 1, 3, 5])


def test_a_slower_extremum_stays() -> None:
    values = np.array([0.0, 1.0, 2.0, 1.0, 0.0, 1.0])
    np.testing.assert_array_equal(steady_keys(T, values, 6.0), np.arange(6))


def test_trembling_is_judged_by_recorded_neighbours_even_where_they_go() -> None:
    values = np.array([0.0, 1.0, 0.0, 1.0, 0.0, 1.0])
    np.testing.assert_array_equal(steady_keys(T, values, 4.0), [0, 5])


def test_a_level_key_counts_as_falling() -> None:
    values = np.array([0.0, 1.0, 1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(steady_keys(T, values, 4.0), [0, 3, 4, 5])


def test_frequency_zero_keeps_every_key() -> None:
    np.testing.assert_array_equal(steady_keys(T, np.array([0.0, 1, 0, 1, 0, 1]), 0.0), np.arange(6))


def test_lines_split_where_the_error_is_largest() -> None:
    # from (0, 0) to (0.5, 0): errors 1, 4, 3, 1; after the split at key 2 they are 1 | 0.33, 0.33
    values = np.array([0.0, 1.0, 4.0, 3.0, 1.0, 0.0])[:, None]
    np.testing.assert_array_equal(line_keys(T, values, 3.0), [0, 2, 5])
    np.testing.assert_array_equal(line_keys(T, values, 0.5), [0, 1, 2, 5])


def test_an_error_equal_to_the_tolerance_does_not_split() -> None:
    values = np.array([0.0, 4.0, 0.0])[:, None]
    np.testing.assert_array_equal(line_keys(np.arange(3.0), values, 4.0), [0, 2])
    np.testing.assert_array_equal(line_keys(np.arange(3.0), values, 3.999), [0, 1, 2])


def test_lines_follow_true_times() -> None:
    # at a quarter of the time, a quarter of the way: no error
    times_s = np.array([0.0, 1.0, 4.0])
    np.testing.assert_array_equal(line_keys(times_s, np.array([[0.0], [1.0], [4.0]]), 1e-9), [0, 2])


def test_lines_keep_a_single_key() -> None:
    np.testing.assert_array_equal(line_keys(np.zeros(1), np.zeros((1, 1)), 1.0), [0])


def test_a_window_of_too_many_keys_becomes_groups_and_the_last_takes_the_rest() -> None:
    # keys 1 to 5 pass one second (1.2 > 1): five keys in two groups, 1 2 | 3 4 5; then key 6 is the last but one
    times_s = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.2, 1.4, 1.6])
    values = np.array([0.0, 1.0, 3.0, 5.0, 6.0, 7.0, 9.0, 10.0])
    times, averaged = average_keys(times_s, values, 2)
    np.testing.assert_allclose(times, [0.0, 0.3, (0.6 + 0.8 + 1.2) / 3, 1.4, 1.6])
    np.testing.assert_allclose(averaged, [0.0, 2.0, 6.0, 9.0, 10.0])


def test_a_window_of_few_keys_stays() -> None:
    times_s, values = np.array([0.0, 0.5, 0.9, 1.5]), np.array([1.0, 2.0, 3.0, 4.0])
    times, averaged = average_keys(times_s, values, 2)
    np.testing.assert_array_equal(times, times_s)
    np.testing.assert_array_equal(averaged, values)


def test_averaging_zero_and_two_keys_change_nothing() -> None:
    for count, most in ((4, 0), (2, 1), (1, 1)):
        times, averaged = average_keys(T[:count], T[:count] * 2, most)
        np.testing.assert_array_equal(times, T[:count])
        np.testing.assert_array_equal(averaged, T[:count] * 2)


def test_slopes_are_those_between_neighbours_and_none_at_the_ends() -> None:
    times_s, values = np.array([0.0, 1.0, 3.0, 4.0]), np.array([[0.0], [5.0], [6.0], [2.0]])
    np.testing.assert_allclose(central_slopes(times_s, values), [[0.0], [2.0], [-1.0], [0.0]])


def test_a_smooth_curve_passes_its_keys_with_those_slopes() -> None:
    curve = smooth_curve(np.array([0.0, 1.0, 3.0]), np.array([[0.0], [5.0], [6.0]]))
    np.testing.assert_allclose(curve([0.0, 1.0, 3.0, -1.0, 9.0])[:, 0], [0.0, 5.0, 6.0, 0.0, 6.0])
    step = 1e-6
    np.testing.assert_allclose((curve([1 + step]) - curve([1 - step])) / (2 * step), [[2.0]], rtol=1e-5)
