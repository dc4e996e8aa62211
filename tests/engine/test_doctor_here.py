"""`smarticles doctor` on the machine that runs the tests."""

from smarticles.commands import doctor


def test_yade_computes() -> None:
    ok, found = doctor._run_script(doctor._YADE)
    assert ok, found
    assert found.endswith("a sphere falls")
