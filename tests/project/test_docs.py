"""Generated pages are current, links lead somewhere, the published schema agrees with the loader."""

import functools
import json
import re
from pathlib import Path

import jsonschema
import pytest
from user_guide.config_words import default_text, meaning
from user_guide.pages import pages as made_pages
from user_guide.who_sets import WHO_SETS

from collaudit.core.config.describe import all_keys
from collaudit.core.config.schema import Config
from collaudit.core.small_files import to_toml

PROJECT = Path(__file__).resolve().parents[2]
DOCS = PROJECT / "docs"
pages = functools.cache(made_pages)  # made once, a test for each


@pytest.mark.parametrize("name", sorted(pages()))
def test_generated_page_is_current(name: str) -> None:
    assert (DOCS / name).read_text(encoding="utf-8") == pages()[name], "run: make docs"


def test_every_published_schema_is_generated() -> None:
    published = {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*schema.json")}
    assert published == {name for name in pages() if name.endswith("schema.json")}


def test_links_between_pages_lead_somewhere() -> None:
    for page in (PROJECT / "README.md", *DOCS.rglob("*.md")):
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_every_key_is_described() -> None:
    for key in all_keys():
        assert meaning(key), key.dotted


def test_every_table_has_someone_who_sets_its_keys() -> None:
    assert set(WHO_SETS) == {key.dotted for key in all_keys() if key.table is not None}


def test_everyday_settings_are_keys() -> None:
    settings = (DOCS / "tutorial.md").read_text(encoding="utf-8").partition("## Everyday settings")[2]
    named = re.findall(r"^\| `([\w.]+)` \|", settings, re.MULTILINE)
    assert len(named) >= 25
    assert set(named) <= {key.dotted for key in all_keys()}


def test_published_schema_is_a_schema_and_takes_what_the_loader_takes() -> None:
    schema = json.loads((DOCS / "config-schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    good = {"detect": {"gamma_nm": {"j": 4}, "n": 13}, "log": {"wrench_bias": [0, 0, 0, 0, 0, 0]}}
    bad = {"detect": {"gama_nm": 4}}
    Config.of(good)
    assert validator.is_valid(good)
    assert not validator.is_valid(bad)


def test_defaults_are_shown_as_toml() -> None:
    import tomllib

    for key in all_keys():
        text = default_text(key)
        if key.table is None and text not in ("absent", "required"):
            assert tomllib.loads(f"v = {text}") is not None, key.dotted
    assert to_toml('a"b\\\x07') == '"a\\"b\\\\\\u0007"'


def test_decisions_are_numbered() -> None:
    titles = re.findall(r"^## (.*)", (DOCS / "decisions.md").read_text(encoding="utf-8"), re.MULTILINE)
    numbers = [int(title.partition(". ")[0]) for title in titles]
    assert numbers == sorted(set(numbers))


def test_links_lead_to_headings_that_exist() -> None:
    """``page.md#heading``, by the name that a viewer gives a heading."""

    def names(page: Path) -> set[str]:
        titles = re.findall(r"^#+ (.*)", page.read_text(encoding="utf-8"), re.MULTILINE)
        return {re.sub(r"[^\w\s-]", "", title.lower()).replace(" ", "-") for title in titles}

    for page in (PROJECT / "README.md", *DOCS.rglob("*.md")):
        for target, heading in re.findall(r"\]\(([^)#:]*)#([^)]+)\)", page.read_text(encoding="utf-8")):
            assert heading in names(page.parent / target if target else page), f"{page.name}: {target}#{heading}"
