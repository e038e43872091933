"""Linear laws are those that two motions together move as each does, on any date."""

from supple.identification.linear_laws import is_linear
from supple.model.law import library


def test_the_linear_laws_of_the_library():
    found = {name for name, law in library().items() if is_linear(law)}
    assert found == {
        "linear_stiffness", "linear_damping", "relaxation", "extra_mode", "support_flexibility"
    }  # fmt: skip
