"""Loading: what a user reads when a configuration is wrong, and what flags do to it."""

from pathlib import Path

import pytest

from collaudit.core.config import load_config
from collaudit.core.errors import ConfigError

BASE = '[robot]\nurdf = "arm.urdf"\n[detect]\ngamma_nm = { j1 = 4.0, j2 = 5 }\npersistence_ms = 25\n'


def _write(folder: Path, text: str) -> Path:
    path = folder / "collaudit.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _message(folder: Path, text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        load_config(_write(folder, text))
    return caught.value.render().replace(str(folder), "")


def test_values_and_base_dir(tmp_path: Path) -> None:
    loaded = load_config(_write(tmp_path, BASE))
    assert loaded.base_dir == tmp_path
    assert loaded.config.robot.urdf == Path("arm.urdf")
    assert loaded.config.detect.gamma_nm == {"j1": 4.0, "j2": 5.0}


def test_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    assert load_config(_write(tmp_path, "\ufeff" + BASE)).config.detect.persistence_ms == 25


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("[detect]\n\ngama_nm = 4\n", [":3: [detect] has no key 'gama_nm'", "did you mean gamma_nm?"]),
        ("[robot]\ngamma_nm = 4\n", [":2:", "did you mean detect.gamma_nm?"]),
        ("[detekt]\nx = 1\n", [":1: the file has no key 'detekt'", "did you mean detect?"]),
        ("[detect]\ngamma_nm = -1\n", [":2: detect.gamma_nm", "found:    -1", "a number above 0"]),
        ('[detect]\ngamma_nm = "4"\n', [":2: detect.gamma_nm", 'found:    "4"']),
        ("[detect]\ngamma_nm = { a = 1, b = 0 }\n", [":2: detect.gamma_nm", "found:    { a = 1, b = 0 }"]),
        ("[detect]\nn = 3.5\n", [":2: detect.n", "a whole number 1 or more"]),
        ("[detect]\nn = true\n", [":2: detect.n", "found:    true"]),
        ("[detect]\nn = 3\npersistence_ms = 4\n", [":1: [detect] give either persistence_ms or n"]),
        ('[log.units]\neffort = "nm"\n', [":2: log.units.effort", 'did you mean "Nm"?']),
        ("[robot]\nbase_rpy_deg = [\n 0,\n 0 ]\n", [":2: robot.base_rpy_deg", "[number, number, number]"]),
        ("[[robot.dh]]\na = 1\n[[robot.dh]]\na = 'x'\n", [":4: robot.dh[1].a", 'found:    "x"']),
        ('[log.csv]\nposition = [1, "a"]\n', [":2: log.csv.position", "a list of whole numbers"]),
        (
            "[fleet.robots.j1]\npaths = ['x']\ngama_nm = 2\n",
            [": [fleet.robots] has no key 'gama_nm'", "did you mean gamma_nm?"],
        ),
        ("[fleet]\nrobots = 3\n", [":2: fleet.robots", "a table of name = a table"]),
        ("[phases]\ncontact = [[4, 3]]\n", [":2: phases.contact: interval [4, 3] does not run forward"]),
        ("[detect]\ngamma_nm = nan\n", [":2: detect.gamma_nm", "found:    nan"]),
        ("[detect]\ngamma_nm = inf\n", [":2: detect.gamma_nm", "found:    inf"]),
        ("[detect]\ngamma_nm = 1e308\n", [":2: detect.gamma_nm", "found:    1e+308"]),
        ("[detect]\ngamma_nm = 1979-05-27\n", [":2: detect.gamma_nm"]),
        ("[detect]\n\ngamma_nm 4\n", [":3: not valid TOML"]),
        ("[detect]\nn = 3\nn = 4\n", [":3: not valid TOML"]),
    ],
)
def test_messages_name_line_found_and_expected(tmp_path: Path, text: str, parts: list[str]) -> None:
    message = _message(tmp_path, text)
    for part in parts:
        assert part in message


def test_unreadable_files(tmp_path: Path) -> None:
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"a = 1\nb = '\xff'\n")
    for path, text in (
        (tmp_path / "none.toml", "no such configuration"),
        (tmp_path, "folder"),
        (binary, "binary.toml:2: not UTF-8"),
    ):
        with pytest.raises(ConfigError) as caught:
            load_config(path)
        assert text in caught.value.render()
        assert caught.value.exit_code == 2


def test_overrides_win_and_merge(tmp_path: Path) -> None:
    path = _write(tmp_path, BASE)
    config = load_config(path, {"detect.gamma_nm": {"j2": 9.0}, "detect.n": 13}).config
    assert config.detect.gamma_nm == {"j1": 4.0, "j2": 9.0}
    assert (config.detect.n, config.detect.persistence_ms) == (13, None)
    assert load_config(path, {"detect.gamma_nm": 3.0}).config.detect.gamma_nm == 3.0


def test_bad_override_names_the_command_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        load_config(_write(tmp_path, BASE), {"detect.watch": 3})
    assert caught.value.where == "command line"


def test_hash_is_of_the_meaning_not_of_folder_or_spelling(tmp_path: Path) -> None:
    one = load_config(_write(tmp_path, BASE)).sha256
    (tmp_path / "b").mkdir()
    spaced = BASE.replace("arm.urdf", "../models/arm.urdf").replace(" = ", "=") + "\n# words\n"
    assert load_config(_write(tmp_path / "b", spaced)).sha256 == one
    assert load_config(_write(tmp_path, BASE.replace("25", "26"))).sha256 != one
    assert load_config(None).sha256 == load_config(_write(tmp_path, "[detect]\ngamma_nm = 4\n")).sha256
