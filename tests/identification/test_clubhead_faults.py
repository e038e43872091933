"""Clubheads whose markers are swapped, slide, repeat, or come in another unit: found and said."""

from pathlib import Path

import numpy as np
import pytest

from supple.identification.clubhead import (
    GOOD,
    IN_DOUBT,
    Club,
    Swing,
    measure_clubhead,
)
from tests.identification.test_clubhead import impact_of, measure
from tests.lab.markers import make_swing

# faults of markers


@pytest.mark.parametrize("markers", [5, 8, 40])
def test_a_swapped_pair_is_named_and_swapped_back(markers):
    made = make_swing(4, markers=markers)
    seen = made.seen.copy()
    seen[20:60, [1, 3]] = seen[20:60, [3, 1]]
    head = measure(made, seen=seen)
    assert any("m1 and m3 are swapped in frames 20 to 59" in said for said in head.warnings)
    clean = measure(made)
    assert np.allclose(head.poses.position, clean.poses.position, atol=1e-4)
    assert impact_of(head).values["speed"] == pytest.approx(impact_of(clean).values["speed"])


def test_a_pair_swapped_through_the_whole_swing_is_found():
    made = make_swing(6, markers=9)
    seen = made.seen.copy()
    seen[:, [0, 5]] = seen[:, [5, 0]]
    head = measure(made, seen=seen)
    assert any("m0 and m5 are swapped" in said for said in head.warnings)
    assert abs(impact_of(head).values["speed"] - made.truth.speed) < 0.2


@pytest.mark.parametrize("size", [0.4e-3, 3e-3])
def test_a_marker_that_slides_is_named_and_left_out(size):
    made = make_swing(7, markers=10)
    seen = made.seen.copy()
    slide = np.linspace(0.0, size, len(seen))[:, None] * np.array([0.6, 0.0, 0.8])
    seen[:, 4] += np.einsum("nij,nj->ni", made.rotation, slide)
    head = measure(made, seen=seen)
    assert any("Marker m4 slides by" in said for said in head.warnings), head.warnings
    assert not any(f"m{i} " in " ".join(head.warnings) for i in (0, 1, 2, 3, 5, 6, 7, 8, 9))
    assert not head.poses.used[:, 4].any()
    assert head.poses.noise == pytest.approx(5e-5, rel=0.1)


@pytest.mark.parametrize("seed", range(4))
def test_with_four_markers_a_slide_is_told_though_none_can_be_blamed(seed):
    made = make_swing(30 + seed, markers=4)
    seen = made.seen.copy()
    slide = np.linspace(0.0, 3e-3, len(seen))[:, None] * np.array([0.6, 0.0, 0.8])
    seen[:, 2] += np.einsum("nij,nj->ni", made.rotation, slide)
    head = measure(made, seen=seen)
    assert head.status == IN_DOUBT and any("slides" in said for said in head.warnings)
    assert measure(made).status == GOOD


def test_a_marker_off_its_place_in_the_cloud_is_named():
    made = make_swing(8, markers=10)
    cloud = made.cloud.copy()
    cloud[2] += [0.0, 1e-3, 0.0]
    head = measure(made, cloud=cloud)
    told = [said for said in head.warnings if "from its place in the cloud" in said]
    assert len(told) == 1 and told[0].startswith("Marker m2 sits")
    assert 0.9 < float(told[0].split()[3]) < 1.1


def test_a_wild_marker_moves_nothing():
    made = make_swing(9, markers=8)
    seen = made.seen.copy()
    seen[40, 3] += [0.05, 0.0, 0.0]
    head, clean = measure(made, seen=seen), measure(made)
    assert any("Marker m3 contradicts the others" in s and "frame 40" in s for s in head.warnings)
    assert np.abs(head.poses.position - clean.poses.position)[40].max() < 1e-4


def test_a_repeated_frame_is_named_and_does_not_count():
    made = make_swing(10, markers=8)
    seen = made.seen.copy()
    seen[50] = seen[49]
    head = measure(made, seen=seen)
    assert any("repeats the one before" in s and "frame 50" in s for s in head.warnings)
    assert not head.poses.found[50] and head.status == GOOD
    assert abs(impact_of(head).values["speed"] - made.truth.speed) < 0.2


@pytest.mark.parametrize(("factor", "word"), [(1e3, "mm read as m"), (1e-3, "m read as mm")])
def test_a_wrong_unit_is_refused_in_words(factor, word):
    made = make_swing(11)
    with pytest.raises(ValueError, match=rf"as far apart.*{word}.*Mend"):
        measure(made, seen=factor * made.seen)
    with pytest.raises(ValueError, match=r"expected a club.*unit of cloud and swing"):
        measure(made, seen=factor * made.seen, cloud=factor * made.cloud)


def test_a_scale_slightly_off_is_told():
    made = make_swing(12, markers=12)
    head = measure(made, seen=1.02 * made.seen)
    assert any("+2 % further apart" in said for said in head.warnings)


def test_names_that_do_not_match_are_refused():
    made = make_swing(13, markers=4)
    swing = Swing("s", Path("s.csv"), made.rate, ("a", "b", "c", "d"), made.seen)
    with pytest.raises(ValueError, match=r"named as in the cloud.*none.*Mend"):
        measure_clubhead(swing, Club(("e", "f", "g", "h"), made.cloud))


def test_a_shaking_club_is_no_smooth_motion():
    made = make_swing(14, markers=12)
    shake = 5e-4 * np.sin(2 * np.pi * 900 * np.arange(len(made.seen)) / made.rate)
    head = measure(made, seen=made.seen + shake[:, None, None] * np.array([0.0, 0.0, 1.0]))
    assert head.status == IN_DOUBT
    assert any("no smooth motion" in said for said in head.warnings)
