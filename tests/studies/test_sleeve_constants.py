"""The sleeves of the thesis: what its modes ask for, and B2 with its factor."""

import json

import pytest

from supple.studies.study import Call, study_named

EQUIVALENTS = {"0 %": (172e3, 950.0), "25 %": (120e3, 3010.0), "50 %": (60e3, 1470.0)}
FACTORS = {"0 %": 4.0, "25 %": 6.6, "50 %": 8.9}


def test_b2_is_named_with_its_factor(tmp_path, capsys):
    study = study_named("sleeve_constants")
    result = study.run(Call(tmp_path))
    assert json.loads((tmp_path / "sleeve_constants.json").read_text()) == result
    assert result["cause"]["erratum"] == "B2"
    assert result["cause"]["made_with"] == "the 0 % stiffness and 1 Hz"
    assert result["cause"]["largest_deviation"] < 0.03
    for row in result["rows"]:
        stiffness, damping = EQUIVALENTS[row["sleeve"]]
        assert row["stiffness"]["asked"] == pytest.approx(stiffness, rel=0.02)
        # the equivalents are of a shaft of 0.0807 N s/m; the rigid club's own ratio asks for less
        assert row["damping"]["asked"] == pytest.approx(damping, rel=0.12)
        assert row["factor"] == pytest.approx(FACTORS[row["sleeve"]], rel=0.02)
        near = abs(row["coupon_without_factor"] / row["damping"]["asked"] - 1)
        assert near < abs(row["damping"]["coupon"] / row["damping"]["asked"] - 1)
    study.show(result)
    said = " ".join(capsys.readouterr().out.split())
    assert "The cause is B2" in said and "4, 6.6 and 8.9 times too large" in said
    assert "4, 6.6 and 8.9" in (tmp_path / "sleeve_constants.md").read_text()
