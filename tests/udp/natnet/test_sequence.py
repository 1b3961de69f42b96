"""Frame numbers, against a set of all that came."""

from hypothesis import given
from hypothesis import strategies as st

from retarget.udp.natnet.sequence import Arrival, FrameSequence


def test_frames_in_order_lose_nothing() -> None:
    sequence = FrameSequence()
    assert all(sequence.judge(number) is Arrival.NEXT for number in range(100, 200))
    assert sequence.lost == 0


def test_numbers_passed_over_are_lost_until_they_come_late() -> None:
    sequence = FrameSequence()
    for number in (10, 11, 15):
        sequence.judge(number)
    assert sequence.lost == 3
    assert sequence.judge(13) is Arrival.LATE
    assert sequence.lost == 2
    assert sequence.judge(13) is Arrival.DOUBLED
    assert sequence.lost == 2


def test_what_came_before_the_first_frame_was_never_lost() -> None:
    sequence = FrameSequence()
    sequence.judge(1000)
    assert sequence.judge(999) is Arrival.DOUBLED
    assert sequence.lost == 0


def test_a_sender_that_starts_over_is_followed() -> None:
    sequence = FrameSequence()
    sequence.judge(5000)
    assert sequence.judge(0) is Arrival.RESTARTED
    assert sequence.judge(1) is Arrival.NEXT
    assert sequence.judge(900_000) is Arrival.RESTARTED
    assert sequence.lost == 0


def test_a_short_take_in_a_loop_is_told_from_doubled_frames_by_the_senders_clock() -> None:
    sequence = FrameSequence()
    numbers = [7, 8, 9, 7, 8, 9, 7]
    arrivals = [sequence.judge(number, stamp) for stamp, number in enumerate(numbers, 100)]
    assert arrivals.count(Arrival.RESTARTED) == 2
    assert arrivals.count(Arrival.NEXT) == 5
    assert sequence.judge(7, 106) is Arrival.DOUBLED


def test_a_sender_whose_clock_starts_over_is_followed_in_the_end() -> None:
    sequence = FrameSequence()
    for number in range(40):
        sequence.judge(number, 10_000 + number)
    arrivals = [sequence.judge(number, 1 + number) for number in range(40)]
    assert arrivals.count(Arrival.RESTARTED) == 1
    assert arrivals.count(Arrival.NEXT) == 30


def test_without_a_clock_a_loop_is_followed_from_its_third_frame() -> None:
    sequence = FrameSequence()
    for number in range(10, 20):
        sequence.judge(number)
    arrivals = [sequence.judge(number) for number in range(10, 20)]
    assert arrivals[:3] == [Arrival.DOUBLED, Arrival.DOUBLED, Arrival.RESTARTED]
    assert set(arrivals[3:]) == {Arrival.NEXT}
    assert sequence.lost == 0


def test_a_network_that_doubles_everything_restarts_nothing() -> None:
    sequence = FrameSequence()
    arrivals = [sequence.judge(number) for number in range(50) for _ in range(3)]
    assert arrivals == [Arrival.NEXT, Arrival.DOUBLED, Arrival.DOUBLED] * 50


@given(st.permutations(range(10)), st.lists(st.integers(0, 9), max_size=5))
def test_counts_agree_with_a_set_of_all_that_came(order: list[int], missing: list[int]) -> None:
    """Whatever the order, lost is what lies between the first and the newest and did not come since the first."""
    sequence = FrameSequence()
    came = [number for number in order if number not in missing]
    arrivals = [sequence.judge(number, number + 1) for number in came]
    if came:
        expected = set(range(came[0], max(came) + 1)) - set(came)
        assert sequence.lost == len(expected)
        newest = came[0]
        for number, arrival in zip(came[1:], arrivals[1:], strict=True):
            assert (arrival is Arrival.NEXT) == (number > newest)
            newest = max(newest, number)
