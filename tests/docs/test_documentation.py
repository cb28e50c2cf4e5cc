"""What README and docs tell people to type is accepted, and where they point to is there."""

import ast
import importlib.util
import re
import shlex
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
import yaml
from hydra.errors import HydraException

import tactile_cube
from tactile_cube.composition import CONFIG, commands, composed, with_recipe
from tactile_cube.drivetrain.effects import catalogue

ROOT = Path(__file__).parents[2]
GENERATED = {"api.md", "commands.md", "configuration.md", "effects.md"}
PAGES = [ROOT / "README.md", *(ROOT / name for name in ("CONTRIBUTING.md",) if (ROOT / name).is_file())]
PAGES += sorted(path for path in (ROOT / "docs").rglob("*.md") if path.name not in GENERATED)
COMMAND = re.compile(r"(?:python -m tactile_cube[. ]|tactile-cube )(\w+)((?:[^\n`#|]|#(?! ))*)")


def typed_commands(text: str) -> list[tuple[str, list[str]]]:
    """Name and words of every command in a page, in fences and in running text."""
    whole = re.sub(r"\\\n\s*", " ", text)
    found = []
    for name, rest in COMMAND.findall(whole):
        if name in commands() and ".md" not in rest:
            found.append((name, shlex.split(rest.split("  #")[0])))
    return found


def relative_links(page: Path) -> list[str]:
    """Files that a page points to, but for pages that are generated."""
    targets = re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))
    paths = [target.partition("#")[0] for target in targets if "://" not in target]
    return [path for path in paths if path and Path(path).name not in GENERATED]


def title(page: Path) -> str:
    """A page as a test's name."""
    return str(page.relative_to(ROOT))


def settings_of(words: list[str]) -> list[str]:
    """The choices and values of a command; of a sweep the first of each."""
    settings = [word for word in words if "=" in word and not word.startswith("-")]
    if "-m" in words or "--multirun" in words:
        settings = [word if "[" in word else word.split(",")[0] for word in settings]
    return settings


@pytest.mark.parametrize("page", [page for page in PAGES if typed_commands(page.read_text("utf-8"))], ids=title)
def test_every_command_that_a_page_shows_is_one_that_composes(page: Path) -> None:
    refused = {}
    for name, words in typed_commands(page.read_text(encoding="utf-8")):
        settings = settings_of(words)
        try:
            config = composed(name, with_recipe(name, settings), with_hydra=True)
        except HydraException as error:
            refused[shlex.join([name, *words])] = str(error)
        else:
            taken = {*config.hydra.overrides.task, *config.hydra.overrides.hydra}
            assert set(settings) <= taken
    assert not refused


def test_the_commands_of_the_quickstarts_are_found_at_all() -> None:
    found = typed_commands((ROOT / "docs" / "match.md").read_text(encoding="utf-8"))
    names = "record compare diagnose effects identify compare export evaluate train average evaluate monitor"
    assert [name for name, _ in found] == names.split()
    assert ["recording=outputs/bench", "effects=[stribeck_friction@q3]", "hydra.run.dir=outputs/fit"] in [
        w for _, w in found
    ]


@pytest.mark.parametrize("page", [page for page in PAGES if relative_links(page)], ids=title)
def test_every_relative_link_resolves(page: Path) -> None:
    assert [target for target in relative_links(page) if not (page.parent / target).exists()] == []


def test_the_table_of_contents_has_every_page() -> None:
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").replace("!!python/name:", "")
    entries = re.findall(r"[\w/]+\.md", yaml.safe_dump(yaml.safe_load(text)["nav"]))
    pages = {str(page.relative_to(ROOT / "docs")) for page in (ROOT / "docs").rglob("*.md")}
    assert sorted(entries) == sorted(pages | GENERATED)


def test_on_the_site_a_link_that_leaves_the_docs_is_text_and_a_dead_one_stays_for_the_strict_build() -> None:
    hook = script("site_links")
    page = SimpleNamespace(file=SimpleNamespace(abs_src_path=str(ROOT / "docs/results/paper.md")))
    text = "[a](../learn.md) [b](../../conf/train.yaml) [c](../gone.md) [d](../../gone.yaml#x) ![e](../images/e.png)"
    shown = hook.on_page_markdown(text, page=page, config=SimpleNamespace(docs_dir=str(ROOT / "docs")))
    assert shown == text.replace("[b](../../conf/train.yaml)", "b")


def test_python_in_the_docs_parses_and_uses_names_that_exist() -> None:
    used = set()
    for page in PAGES:
        for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL):
            tree = ast.parse(block)
            used |= {
                node.attr
                for node in ast.walk(tree)
                if isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id == "tactile_cube"
            }
    assert {"train", "compare", "recording_from_arrays", "make_env"} <= used <= set(tactile_cube.__all__)


def script(name: str) -> ModuleType:
    """A file of docs/, imported."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    return script("generate")


def test_the_glossary_names_every_effect_with_its_parameters_and_its_picture(generator: ModuleType) -> None:
    page = generator.effects_page()
    for one in tactile_cube.effects():
        section = page.split(f"\n## {one.name}\n")[1].split("\n## ")[0]
        assert all(f"\n| {parameter} | " in section for parameter, *_ in one.rows)
        assert (f"images/effects/{one.name}.png" in section) == (one.name in catalogue())
    rows = [line for line in page.splitlines() if line.startswith("| [")]
    assert all(re.sub(r"\\\|", "", row).count("|") == 4 for row in rows)


def test_the_api_page_has_every_public_name_with_its_signature(generator: ModuleType) -> None:
    page = generator.api_page()
    assert [name for name in tactile_cube.__all__ if f"\n## {name}\n\n```text\n{name}(" not in page] == []


def test_the_commands_page_shows_every_command(generator: ModuleType) -> None:
    page = generator.commands_page()
    assert [name for name in commands() if f"\n## {name}\n" not in page] == []


def test_the_configuration_page_shows_every_file(generator: ModuleType) -> None:
    page = generator.configuration_page()
    for file in CONFIG.glob("*/*.yaml"):
        if file.parent.name != "hydra":
            assert f"`{file.parent.name}={file.stem}`" in page
