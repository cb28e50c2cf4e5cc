from tactile_cube.command_help import help_text


def test_help_marks_the_default_of_each_group() -> None:
    text = help_text("train")
    assert "*full" in text
    assert "*multi_sync" in text
    assert " seed: 0" in text
