"""What a sealed case is drawn to be: nothing that no lab would record."""

import numpy as np
import pytest

from tests.lab.carries import Carry
from tests.lab.causes import Hidden, weaker
from tests.lab.clubs import draw_scattered_club
from tests.lab.runs import carry_out, draw_run
from tests.lab.sealed import held_back, stays


@pytest.mark.parametrize("pull", [0.6, 2.0])  # lets go at 1.3 and 0.7 of the clean way
@pytest.mark.parametrize(("sign", "halved"), [(-1.0, True), (1.0, False)])
def test_no_spring_that_softens_is_drawn_so_that_it_lets_go(sign, halved, pull):
    """A wrist on a softening spring had spun 47 times about its pivot."""
    club = draw_scattered_club(np.random.default_rng(3), "A", "pinned_wrist", 512)
    run = draw_run(club, "impact", 1.0, np.random.default_rng(4))
    wrist, moved = club.structure().places["wrist"], carry_out(club, run)[1]
    reach = np.abs(wrist.stretch(moved.position, moved.angle)).max()
    size = sign * pull * wrist.stiffness / reach**2
    carry = Carry("cubic_stiffness", "wrist", size, 0 * size)
    facts = {"largest": float(np.abs(size).max())}
    cause = Hidden("cubic_stiffness", "wrist", 2.0, float(size[0]), facts=facts, carries=(carry,))
    assert stays(cause, club, [run], []) != halved
    found = held_back(cause, club, [run], [])
    assert stays(found, club, [run], [])
    if not halved:
        assert found is cause
        return
    times = np.log2(cause.size / found.size)
    assert times == round(times) >= 1
    assert found.strength == cause.strength / 2**times == cause.strength * found.size / cause.size
    assert weaker(found).carries[0].size[0] == found.size / 2 == weaker(found).size
