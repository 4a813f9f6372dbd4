import plycloth as pc


def test_version_is_that_of_the_crate():
    assert pc.__version__.count(".") == 2
