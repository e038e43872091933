"""Agreement of two instruments: closed forms, coverage by chance, and who is unlike the others."""

import numpy as np
import pytest

from supple.identification.instruments import agreement, averages, limits, outliers


def made(seed: int, subjects=14, swings=10, bias=1.0, within=2.0, between=0.5, odd=None):
    """Names and two readings of each swing; `odd` = (subject, factor of its errors)."""
    rng = np.random.default_rng(seed)
    who = np.repeat(np.arange(subjects), swings)
    error = (
        bias + within * rng.standard_normal(len(who)) + between * rng.standard_normal(subjects)[who]
    )
    if odd is not None:
        error[who == odd[0]] *= odd[1]
    truth = rng.normal(0.0, 10.0, len(who))
    return [f"golfer {k}" for k in who], truth + error, truth


def test_bias_and_limits_are_mean_and_196_deviations():
    difference = np.array([1.0, 2.0, 4.0, 5.0])
    found = limits(difference, "A")
    spread = np.sqrt(10.0 / 3.0)
    assert found.bias.value == pytest.approx(3.0) and found.spread == pytest.approx(spread)
    assert found.upper.value == pytest.approx(3.0 + 1.959964 * spread, rel=1e-6)
    assert found.lower.value == pytest.approx(3.0 - 1.959964 * spread, rel=1e-6)
    # Student's t with 3 degrees of freedom: 3.18245
    assert found.bias.high == pytest.approx(3.0 + 3.18245 * spread / 2.0, rel=1e-5)
    assert found.upper.low < found.upper.value < found.upper.high


def test_readings_that_swap_change_the_sign_and_nothing_else():
    who, first, second = made(1)
    one, other = agreement(who, first, second), agreement(who, second, first)
    assert one.overall.bias.value == pytest.approx(-other.overall.bias.value)
    assert one.overall.upper.high == pytest.approx(-other.overall.lower.low)
    assert one.sizes == pytest.approx(other.sizes)


def test_exact_instruments_agree_exactly():
    who, first, _ = made(2)
    found = agreement(who, first + 0.25, first)
    assert found.overall.bias.value == pytest.approx(0.25, abs=1e-12)
    assert found.overall.spread < 1e-12 and found.outliers == ()


def test_intervals_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(7)
    held = np.zeros(3)
    runs = 1500
    for _ in range(runs):
        found = limits(rng.normal(0.3, 2.0, 8))
        truths = (0.3, 0.3 - 1.959964 * 2.0, 0.3 + 1.959964 * 2.0)
        for k, (one, truth) in enumerate(zip((found.bias, found.lower, found.upper), truths)):
            held[k] += one.low <= truth <= one.high
    assert ((held / runs > 0.935) & (held / runs < 0.965)).all(), held / runs


def test_several_swings_a_subject_do_not_feign_more_subjects():
    """Differences between subjects count as many times as there are subjects."""
    held, naive, runs = np.zeros(2), 0, 400
    total = np.hypot(1.0, 2.0)
    for seed in range(runs):
        who, first, second = made(seed, subjects=10, swings=6, bias=1.0, within=1.0, between=2.0)
        found = agreement(who, first, second)
        held[0] += found.overall.bias.low <= 1.0 <= found.overall.bias.high
        held[1] += found.overall.upper.low <= 1.0 + 1.959964 * total <= found.overall.upper.high
        plain = limits(first - second)
        naive += plain.bias.low <= 1.0 <= plain.bias.high
    assert ((held / runs > 0.92) & (held / runs < 0.98)).all(), held / runs
    assert naive / runs < 0.75  # a wrong model must fail


def test_parts_within_and_between_subjects_are_told_apart():
    who, first, second = made(3, subjects=60, swings=40, within=1.0, between=2.0)
    found = agreement(who, first, second).overall
    assert found.within == pytest.approx(1.0, rel=0.1)
    assert found.between == pytest.approx(2.0, rel=0.25)


def test_the_strange_subject_is_found_wherever_it_stands():
    found = []
    for seed in range(60):
        odd = seed % 14
        one = agreement(*made(seed, bias=0.0, between=0.0, odd=(odd, 4.0)))
        found.append([each.subject for each in one.outliers][:1] == [f"golfer {odd}"])
        if found[-1]:
            assert one.without is not None and one.without.spread < one.overall.spread
    assert np.mean(found) >= 0.9


def test_where_all_are_alike_one_in_twenty_is_accused():
    accused = sum(
        bool(agreement(*made(seed, bias=0.0, between=0.0)).outliers) for seed in range(400)
    )
    assert 4 <= accused <= 32


def test_a_difference_that_grows_with_the_size_is_told():
    who, first, second = made(4, within=0.5)
    assert agreement(who, first, second).slope_p > 1e-3
    grown = agreement(who, 1.2 * first, second)
    assert grown.slope == pytest.approx(0.18, abs=0.05) and grown.slope_p < 1e-10


def test_averages_of_normal_errors_foretell_their_95_per_cent():
    rng = np.random.default_rng(5)
    points = rng.standard_normal((40_000, 2))
    distance = np.hypot(*points.T)
    told = averages(dict(zip("abc", [distance.mean()] * 3)), is_distance=True)
    assert told.single == pytest.approx(np.quantile(distance, 0.95), rel=0.02)
    size = np.abs(points[:, 0])
    told = averages(dict(zip("abc", [size.mean()] * 3)), is_distance=False)
    assert told.single == pytest.approx(np.quantile(size, 0.95), rel=0.02)


def test_few_subjects_accuse_nobody():
    assert outliers({"a": 1.0, "b": 1.0, "c": 1.0, "d": 99.0}) == ()


@pytest.mark.parametrize(
    ("who", "first", "second", "said"),
    [
        (["a"], [1.0], [2.0], "at least 3 pairs"),
        (["a"] * 3, [1.0, 2.0], [1.0, 2.0], "as many subjects as pairs"),
        (["a"] * 3, [1.0, np.nan, 2.0], [1.0, 2.0, 3.0], "finite numbers"),
    ],
)
def test_what_cannot_be_compared_is_said(who, first, second, said):
    with pytest.raises(ValueError, match=rf"expected .*{said}.* Mend: "):
        agreement(who, np.array(first), np.array(second))
    with pytest.raises(ValueError, match="numbers above 0"):
        averages({"a": 1.0, "b": 0.0, "c": 2.0}, is_distance=True)
